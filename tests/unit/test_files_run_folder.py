import hashlib
import json
import re
import shutil
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

import deboom
from deboom.errors import InputError
from deboom.files import run_folder
from deboom.files.run_folder import environment_record, finish_run, hash_files, start_run


def names(folder):
    return sorted(path.relative_to(folder).as_posix() for path in folder.rglob("*"))


def test_a_lock_that_is_a_link_is_not_followed(tmp_path):
    precious, folder = tmp_path / "mine.txt", tmp_path / "run"
    precious.write_text("mine")
    folder.mkdir()
    (folder / run_folder.LOCK).symlink_to(precious)
    assert not run_folder.is_held(folder)
    with pytest.raises(InputError, match=r"\.lock cannot be locked"), run_folder.held(folder):
        pass
    assert precious.read_text() == "mine"


def test_a_run_is_unfinished_until_it_is_finished(tmp_path):
    run = start_run(tmp_path / "results", "front", seed=3, record={})
    assert run.folder.is_dir()
    assert run.folder.parent == tmp_path / "results" / "front"
    assert re.fullmatch(r"\d{4}-\d\d-\d\d_\d{6}_seed3\.unfinished", run.folder.name)
    run.save_text("note.txt", "µm\n")
    final = finish_run(run)
    assert final.name == run.folder.name.removesuffix(".unfinished")
    assert names(tmp_path / "results" / "front") == [
        final.name,
        f"{final.name}/note.txt",
        f"{final.name}/run.json",
    ]
    assert (final / "note.txt").read_bytes() == "µm\n".encode()


def test_names_are_unique_within_a_second_and_sort_by_time(tmp_path, monkeypatch):
    class Clock(run_folder.datetime):
        second = 30

        @classmethod
        def now(cls, tz=None):
            return cls(2026, 11, 21, 10, 45, cls.second, tzinfo=tz)

    monkeypatch.setattr(run_folder, "datetime", Clock)
    first = finish_run(start_run(tmp_path, "front", seed=1, record={}))
    second = start_run(tmp_path, "front", seed=1, record={})
    third = start_run(tmp_path, "front", seed=1, record={})
    Clock.second = 31
    fourth = start_run(tmp_path, "front", seed=1, record={})
    finished = [first, *(finish_run(run) for run in (second, third, fourth))]
    assert [path.name for path in finished] == [
        "2026-11-21_104530_seed1",
        "2026-11-21_104530_seed1_2",
        "2026-11-21_104530_seed1_3",
        "2026-11-21_104531_seed1",
    ]
    assert sorted(finished) == finished


def test_json_takes_numpy_and_refuses_nan(tmp_path):
    run = start_run(tmp_path, "front", seed=1, record={})
    content = {"n": np.int64(3), "x": np.float64(0.1), "a": np.arange(2.0), "p": Path("a") / "b"}
    run.save_json("summary.json", content)
    text = (run.folder / "summary.json").read_text(encoding="utf-8")
    assert json.loads(text) == {"n": 3, "x": 0.1, "a": [0.0, 1.0], "p": "a/b"}
    with pytest.raises(ValueError, match="Out of range float"):
        run.save_json("bad.json", {"x": float("nan")})
    with pytest.raises(TypeError, match="set has no form in JSON"):
        run.save_json("bad.json", {"x": {1}})
    assert names(run.folder) == ["run.json", "summary.json"]


def test_folders_inside_a_run_are_made_and_those_outside_are_refused(tmp_path):
    run = start_run(tmp_path, "front", seed=1, record={})
    run.save_bytes("figures/front.png", b"\x89PNG")
    run.save_bytes("figures/front.png", b"\x89PNG2")
    assert names(run.folder) == ["figures", "figures/front.png", "run.json"]
    assert (run.folder / "figures" / "front.png").read_bytes() == b"\x89PNG2"
    for name in ("../a.txt", "/tmp/a.txt", "figures/../../a.txt", "a\\b.txt", ""):
        with pytest.raises(InputError, match="is not a file name within"):
            run.save_text(name, "x")
    assert names(run.folder) == ["figures", "figures/front.png", "run.json"]


def test_a_finished_run_takes_no_more_files(tmp_path):
    run = start_run(tmp_path, "front", seed=1, record={})
    final = finish_run(run)
    for name in ("late.txt", "figures/late.png"):
        with pytest.raises(InputError, match="is gone: the run is finished or discarded"):
            run.save_text(name, "x")
    assert list(tmp_path.glob("*/*")) == [final]
    with pytest.raises(InputError, match="cannot be renamed"):
        finish_run(run)


def test_a_discarded_run_leaves_nothing_that_it_made(tmp_path):
    run = start_run(tmp_path / "a" / "b", "front", seed=1, record={})
    run.save_bytes("figures/front.png", b"1")
    run.discard()
    assert names(tmp_path) == []
    (tmp_path / "results").mkdir()
    kept = finish_run(start_run(tmp_path / "results", "front", seed=1, record={}))
    start_run(tmp_path / "results", "front", seed=1, record={}).discard()
    start_run(tmp_path / "results", "other", seed=1, record={}).discard()
    folder = f"results/front/{kept.name}"
    assert names(tmp_path) == ["results", "results/front", folder, f"{folder}/run.json"]


@pytest.mark.parametrize(
    ("study", "seed", "words"),
    [
        *(
            ("front", seed, "choose a whole number from 1")
            for seed in (0, -1, True, 1.0, "1", None)
        ),
        *((study, 1, "use letters, digits, _ and -") for study in ("", "..", "a/b", "a b", "é")),
    ],
)
def test_seeds_below_one_and_studies_that_are_no_folder_names_are_refused(
    tmp_path, study, seed, words
):
    with pytest.raises(InputError, match=words):
        start_run(tmp_path / "results", study, seed=seed, record={})
    assert names(tmp_path) == []


def test_an_output_that_is_a_file_is_refused(tmp_path):
    (tmp_path / "results").write_text("a file")
    for out in (tmp_path / "results", tmp_path / "results" / "deeper"):
        with pytest.raises(InputError, match=r"cannot be written .*: choose another with --out"):
            start_run(out, "front", seed=1, record={})
    assert names(tmp_path) == ["results"]


def test_a_folder_without_permission_is_refused_and_nothing_stays(tmp_path, monkeypatch):
    """The mode bits of a folder do not stop root, so the operating system's answer is played."""
    make = Path.mkdir

    def no_runs(path, *arguments, **options):
        if path.parent.name == "front":
            raise PermissionError(13, "Permission denied")
        make(path, *arguments, **options)

    monkeypatch.setattr(Path, "mkdir", no_runs)
    with pytest.raises(InputError, match=r"results cannot be written \(Permission denied\)"):
        start_run(tmp_path / "results", "front", seed=1, record={})
    assert names(tmp_path) == []


def test_files_are_hashed_under_their_relative_names(tmp_path):
    (tmp_path / "data").mkdir()
    (tmp_path / "data" / "b.uff").write_bytes(b"b")
    (tmp_path / "a.toml").write_bytes(b"a")
    paths = [tmp_path / "data" / "b.uff", tmp_path / "a.toml"]
    assert hash_files(paths, relative_to=tmp_path) == {
        "a.toml": hashlib.sha256(b"a").hexdigest(),
        "data/b.uff": hashlib.sha256(b"b").hexdigest(),
    }
    assert list(hash_files(paths, relative_to=tmp_path)) == ["a.toml", "data/b.uff"]
    with pytest.raises(InputError, match=r"no\.uff cannot be read"):
        hash_files([tmp_path / "no.uff"], relative_to=tmp_path)


def test_the_environment_names_versions_and_revision():
    record = environment_record(("numpy", "no-such-package"))
    assert record["packages"] == {"numpy": np.__version__, "no-such-package": None}
    assert record["python"] == ".".join(map(str, sys.version_info[:3]))
    assert json.loads(json.dumps(record)) == record


def test_the_revision_is_of_the_checkout_that_tracks_the_package(tmp_path, monkeypatch):
    def git(*arguments):
        run_folder.subprocess.run(
            ["git", "-c", "user.name=t", "-c", "user.email=t@t", *arguments],
            cwd=tmp_path,
            check=True,
        )

    module = tmp_path / "package" / "layer" / "module.py"
    module.parent.mkdir(parents=True)
    module.write_text("x = 1\n")
    monkeypatch.setattr(run_folder, "__file__", str(module))
    monkeypatch.setenv("GIT_CEILING_DIRECTORIES", str(tmp_path.parent))
    record, sources = environment_record(()), run_folder.hash_sources(module.parents[1])
    assert (record["git"], record["sources_sha256"]) == (None, sources)
    git("init")
    assert environment_record(())["git"] is None  # there, but not tracked: an unrelated checkout
    git("add", ".")
    git("commit", "-m", "first")
    record = environment_record(())["git"]
    assert re.fullmatch("[0-9a-f]{40}", record["revision"])
    assert record["dirty"] is False
    module.write_text("x = 2\n")
    assert environment_record(())["git"] == {**record, "dirty": True}
    monkeypatch.setenv("PATH", "")
    assert environment_record(())["git"] is None


def test_a_run_goes_by_its_name_in_the_results_here(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    run = start_run(tmp_path / "results", "front", seed=1, record={"study": "front"})
    folder = finish_run(run)
    read_back = run_folder.read_run(Path(folder.name))
    assert (read_back.study, read_back.name) == ("front", folder.name)
    assert run_folder.read_run(folder.name[:12]).folder == read_back.folder
    assert run_folder.read_run(f"front/{folder.name[:4]}").folder == read_back.folder
    shutil.copytree(folder, tmp_path / "results" / "other" / folder.name)
    with pytest.raises(InputError, match=f"2 runs: say results/front/{folder.name} or results/"):
        run_folder.read_run(folder.name[:12])
    with pytest.raises(InputError, match=f"say results/front/{folder.name} or results/other"):
        run_folder.read_run(Path(folder.name))
    with pytest.raises(InputError, match="is no run folder"):
        run_folder.read_run(Path("2020-01-01_000000_seed1"))


TWO = deboom.ResponseFunction(lambda x: np.c_[x**2, x], ("a",), ("y", "z"), "dB")


def test_what_a_notebook_computed_is_saved_as_a_run_and_read_back(tmp_path):
    space, out = TWO.design_space(), tmp_path / "results"
    robust = deboom.Robust(TWO, space, draws=16)
    budget = {"population": 8, "generations": 3, "verified_with": 16}
    front = deboom.search(robust, **budget, seed=3)
    run = deboom.save_run(front, out)
    again = deboom.read_run(run.folder)
    assert (again.study, again.name[-6:], again.finished) == ("notebook", "_seed3", True)
    np.testing.assert_array_equal(again.front.designs, front.values.designs)
    assert dict(again.front.picks) == dict(front.picks)
    # the variables stand beside the objectives
    np.testing.assert_array_equal(again.table("front")["a [1]"], front.values.designs[:, 0])
    assert again.record["facts"]["search"].startswith("NSGA-II, 3 generations, ")
    more = deboom.search(robust, **budget, first_population=again, polish=False)
    n = len(front.values)
    np.testing.assert_array_equal(more.search.evaluated.designs[:n], front.values.designs)
    (out / "notebook" / run.name / "front.csv").write_text("edited")
    with pytest.raises(InputError, match="has been edited"):
        _ = again.front


def test_experiments_and_sensitivities_are_saved_and_read_back(tmp_path):
    def fails(designs):
        return np.where(designs > 1.1, np.nan, np.c_[designs**2, designs])

    model = deboom.ResponseFunction(fails, ("a",), ("y", "z"), "1", n_lines=3)
    experiment = deboom.doe(model, model.design_space(), n=16)
    run = deboom.save_run(experiment, tmp_path, study="mine", seed=2)
    assert run.folder.parent == tmp_path / "mine"
    again = deboom.read_run(run.folder).doe
    assert 0 < again.doe.n_failed < 16
    # names that look like numbers
    numbered = replace(experiment, doe=replace(experiment.doe, name="007", plan="16"))
    named = deboom.save_run(numbered, tmp_path).doe.doe
    assert (named.name, named.plan) == ("007", "16")
    pd.testing.assert_frame_equal(again.table, experiment.table)
    assert deboom.correlation(again, resamples=100).pearson[0, 1] > 0.99
    assert len(again.front(["y"])) == 1
    indices = deboom.sobol(TWO, TWO.design_space(), n=16)
    kept = deboom.read_run(deboom.save_run(indices, tmp_path).folder)
    pd.testing.assert_frame_equal(kept.sobol, indices.table)
    effects = deboom.morris(TWO, TWO.design_space(), trajectories=4)
    assert deboom.save_run(effects, tmp_path).tables == ("morris",)
    with pytest.raises(InputError, match="no table 'sobol': it has doe"):
        _ = run.sobol
    with pytest.raises(InputError, match="which is no front study"):
        _ = run.front
    before = sorted(tmp_path.rglob("*"))
    with pytest.raises(InputError, match="DataFrame cannot be saved as a run"):
        deboom.save_run(indices.table, tmp_path)
    with pytest.raises(InputError, match="use letters, digits"):
        deboom.save_run(indices, tmp_path, study="../mine")
    assert sorted(tmp_path.rglob("*")) == before


def test_a_long_table_is_saved_compressed_as_that_of_a_study(tmp_path, monkeypatch):
    experiment = deboom.doe(TWO, TWO.design_space(), n=16)
    monkeypatch.setattr("deboom.tabled.MOST_ROWS", 15)
    run = deboom.save_run(experiment, tmp_path)
    assert not (run.folder / "doe.csv").exists()
    assert run.tables == ("doe",)
    pd.testing.assert_frame_equal(run.doe.table, experiment.table)


def test_responses_of_a_study_are_its_last_columns_of_one_unit(tmp_path):
    experiment = deboom.doe(TWO, TWO.design_space(), n=16)
    run = deboom.save_run(experiment, tmp_path)
    for name in ("responses", "n_lines"):
        del run.record[name]
    again = run.doe
    assert again.doe.response_names == ("y", "z")
    # how many lines a sum has is not kept, and so there is no mean over them
    assert list(again.table.columns[-2:]) == ["failure", "sum [dB]"]
    plain = deboom.ResponseFunction(TWO.function, ("a",), ("y", "z"), "1")
    run = deboom.save_run(deboom.doe(plain, plain.design_space(), n=16), tmp_path)
    del run.record["responses"]
    with pytest.raises(InputError, match=r"same unit: say which .* deboom.read_designs"):
        _ = run.doe


def test_latest_is_the_run_of_a_study_that_began_last_and_has_finished(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    folder = Path("results/front")
    with pytest.raises(InputError, match="no run has finished in"):
        run_folder.read_run(folder / "latest")
    names = [f"2026-11-2{day}_104530_seed1" for day in (1, 2)]
    for name in (*names, "2026-11-23_104530_seed1.unfinished"):
        (folder / name).mkdir(parents=True)
        (folder / name / "run.json").write_text('{"study": "front"}')
    assert run_folder.read_run(folder / "latest").folder == folder / names[1]
    assert run_folder.read_run("front/latest").folder.name == names[1]
    assert run_folder.read_run("latest").folder == folder / names[1]
    begun = run_folder.find_run(Path("results"), "front", "latest")
    assert begun.folder.name == "2026-11-23_104530_seed1.unfinished"
    with pytest.raises(InputError, match="no run of other was interrupted"):
        run_folder.find_run(Path("results"), "other", "latest")
    (folder / "latest").mkdir()
    (folder / "latest" / "run.json").write_text('{"study": "front"}')
    assert run_folder.read_run(folder / "latest").folder == folder / "latest"


def test_latest_goes_by_the_start_not_by_the_name(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    folder = finish_run(start_run(Path("results"), "front", seed=1, record={"study": "front"}))
    home = folder.parent
    for name, record in (
        ("example", "{}"),
        ("zebra", '{"started": "2026-01-01 00:00:00"}'),
        ("damaged", "{"),
    ):
        (home / name).mkdir()
        (home / name / "run.json").write_text(record)
    for wanted in (home / "latest", "front/latest", "latest"):
        assert run_folder.read_run(wanted).folder == folder
    renamed = folder.rename(home / "chosen")
    assert run_folder.read_run("front/latest").folder == renamed
    (home / "2999-01-01_000000_seed1").mkdir()
    (home / "2999-01-01_000000_seed1" / "run.json").write_text("{")
    with pytest.raises(InputError, match=r"2999-01-01_000000_seed1/run\.json is not JSON"):
        run_folder.read_run("front/latest")


def test_nothing_is_written_into_the_example_of_a_clone(tmp_path):
    (tmp_path / "example").mkdir()
    (tmp_path / "example" / "run.json").write_text('{"study": "front"}')
    entry = run_folder.read_run(tmp_path / "example")
    for name in ("", "supplier"):
        with pytest.raises(InputError, match="name another folder with --out"):
            entry.writable(name)
    mine = run_folder.RunEntry(tmp_path / "mine", {})
    assert mine.writable("supplier") == tmp_path / "mine" / "supplier"


def test_no_link_leads_a_run_elsewhere(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "elsewhere").mkdir()
    out = Path("results")
    out.mkdir()
    (out / "look").symlink_to(tmp_path / "elsewhere")
    (out / "circle").symlink_to("circle")
    with pytest.raises(InputError, match="results/look is a link out of results"):
        start_run(out, "look", seed=1, record={})
    with pytest.raises(InputError, match="cannot be written"):
        start_run(out, "circle", seed=1, record={})
    assert list((tmp_path / "elsewhere").iterdir()) == []
    run = finish_run(start_run(tmp_path / "elsewhere", "front", seed=1, record={"study": "look"}))
    (out / "front").mkdir()
    (out / "front" / f"{run.name}").symlink_to(run)
    entries, (problem, *_) = run_folder.readable_runs(out)
    assert (entries, "is a link out of results" in str(problem)) == ((), True)
    for wanted in ("latest", "front/latest", out / "front" / "latest", run.name):
        with pytest.raises(InputError, match="is a link out of results"):
            run_folder.read_run(wanted)
    with pytest.raises(InputError, match="is a link out of results"):
        run_folder.find_run(out, "front", run.name)
    assert run_folder.read_run(run).name == run.name  # a folder that the user names


def test_what_a_killed_process_left_is_taken_away_be_it_a_folder_a_file_or_a_link(tmp_path):
    precious = tmp_path / "precious"
    precious.mkdir()
    run = start_run(tmp_path, "front", seed=1, record={"study": "front", "seed": 1})
    (run.folder / ".write-a").mkdir()
    (run.folder / ".write-b").write_text("")
    (run.folder / ".write-c").symlink_to(precious)
    again = run_folder.find_run(tmp_path, "front", run.folder.name)
    assert again.run().started == run.started
    assert names(run.folder) == ["run.json"]
    assert precious.is_dir()
