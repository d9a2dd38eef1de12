"""Comparing run folders, listing and showing them: through the same command as a user."""

import json
import shutil
from html import unescape
from pathlib import Path

import pandas as pd
import pytest
from compare_samples import COMPARE, compare_runs

from command_line import call
from deboom.errors import InputError
from deboom.files.front_run import ComparedRun
from deboom.files.run_folder import RunEntry
from deboom.pages.comparison import configuration_names
from deboom.runs.overview import refresh_overview
from deboom.runs.runner import load_study, run_study
from deboom.vehicles.booming_model import Motion
from pinned_pages import hold

FRONT = """'''Which of five springs are best?'''

from dataclasses import dataclass
from pathlib import Path

import pandas as pd

from deboom.explore.front import replicates, verified as verified_values
from samples.known_truth import quad2
from deboom.explore.robust import Robust
from deboom.explore.scatter import sobol_sample
from deboom.explore.space import stiffness_factor_space
from deboom.report import Report
from deboom.runs.search import SearchOptions


@dataclass(frozen=True)
class Options:
    seed: int = 1
    search: SearchOptions = SearchOptions(generations=12, population=16)
    springs: int = 5
    tolerance: float = 0.15
    platform: Path = Path(__file__).parent / "here"


@dataclass(frozen=True)
class Model:
    robust: Robust


def prepare(options):
    model = quad2(options.springs, seed=1)
    space = stiffness_factor_space(model.variable_names, tolerance=options.tolerance)
    return Model(Robust(model, space, sobol_sample(options.springs, 32, seed=options.seed)))


def run(model, options, context=None):
    files = (options.platform / "platform.toml", options.platform / "masses.csv")
    search = options.search.searched(
        model.robust, seed=options.seed, run=context, inputs=files
    )
    verified = verified_values(search.front, replicates(model.robust, 1024, seed=options.seed))
    sums = {
        "SPLV mean sum [dB(A)]": verified.mean_sum,
        "SPLV sigma sum [dB]": verified.sigma_sum,
    }
    columns = [f"{name} [1]" for name in model.robust.space.names]
    report = Report("Springs", "Which?")
    report.section("Front")
    designs = dict(zip(columns, search.front.designs.T, strict=True))
    report.table("front", pd.DataFrame(sums | designs))
    report.table("convergence", pd.DataFrame({"hypervolume [1]": search.hypervolume}))
    report.number("n_front", len(search.front), "", "designs found", headline="d")
    report.facts["verification_draws"] = 1024
    report.inputs += files
    return report
"""


@pytest.fixture(scope="module")
def home(tmp_path_factory):
    """Return a folder with studies and two platforms, one of them with other masses."""
    home = tmp_path_factory.mktemp("home")
    for name in ("here", "there"):
        (home / "studies" / name).mkdir(parents=True)
        (home / "studies" / name / "platform.toml").write_text("title = 'springs'\n")
        (home / "studies" / name / "masses.csv").write_text(f"mass\n{len(name)}\n")
    (home / "studies" / "springs.py").write_text(FRONT, encoding="utf-8")
    return home


@pytest.fixture(scope="module")
def studies(home):
    return home / "studies"


@pytest.fixture(scope="module")
def results(home):
    return home / "results"


@pytest.fixture(scope="module")
def springs(studies, results):
    """Run the study with options."""

    def run(**options):
        out = results if not options.keys() - {"seed"} else results.with_name("more")
        return run_study(load_study(studies / "springs.py"), out, {"seed": 1, **options})

    return run


@pytest.fixture(scope="module")
def pair(springs):
    """Two seeds of one study."""
    return [springs(seed=seed) for seed in (1, 2)]


@pytest.fixture
def judged(studies):
    def judge(runs, out, **changes):
        options = {"out": out, "studies": studies, "samples": 1024, "seed": 1, **changes}
        return compare_runs(runs, **options)

    return judge


@pytest.fixture(scope="module")
def compared(pair, results, studies):
    return compare_runs(pair, out=results, studies=studies, samples=1024, seed=1)


def test_two_seeds_of_one_study(compared):
    hold(compared[0], "compare")


def test_runs_of_different_models_get_a_verdict_each_in_any_order(pair, springs, judged, tmp_path):
    runs = [*pair, springs(seed=3, generations=1, tolerance=0.3)]
    folder, verdicts = judged(runs, tmp_path / "a")
    hold(folder, "compare_models", like="compare")
    again, reversed_verdicts = judged(runs[::-1], tmp_path / "b")
    assert verdicts == reversed_verdicts
    for name in ("judge_1_pairs.csv", "judge_2_fronts.csv"):
        assert (folder / name).read_bytes() == (again / name).read_bytes()


def test_each_model_prefers_what_was_found_for_its_scatter(springs, judged, tmp_path):
    sizes = {"generations": 30, "population": 32}
    runs = [springs(**sizes, tolerance=tolerance) for tolerance in (0.15, 0.9)]
    folder, verdicts = judged(runs, tmp_path)
    assert verdicts == ["Not comparable: different models, which do not agree on the better front."]
    page = unescape((folder / "report.html").read_text(encoding="utf-8"))
    first_screen = page.partition("Judged by the model of tolerance 0.15")[0]
    assert "is really better" not in first_screen
    assert page.count("What the runs do not have in common</h2>") == 1
    summary = json.loads((folder / "summary.json").read_text(encoding="utf-8"))
    assert summary["verdict"] == "not comparable: different models"
    assert summary["judge_1_n_real"] == 1
    noise = summary["judge_1_noise_percent"]
    assert abs(summary["judge_1_hypervolume_difference_percent"]) > noise


def test_a_front_that_covers_all_of_another_is_better_whatever_the_noise(springs, judged, tmp_path):
    runs = [springs(generations=n, population=24) for n in (2, 60)]
    folder, verdicts = judged(runs, tmp_path)
    pairs = pd.read_csv(folder / "pairs.csv")
    assert pairs[["first covers second [%]", "second covers first [%]"]].max(axis=None) == 100.0
    assert "generations 60 is really better than generations 2" in verdicts[0]


def test_fronts_of_parts_get_a_verdict(tmp_path, monkeypatch):
    study = load_study("mount_selection")
    budget = {"seed": 1, "population": 4, "samples": 16, "every_set_up_to": 1}
    budget |= {"mount": ["TSM", "Du"], "motion": Motion.prescribed}
    runs = [run_study(study, tmp_path, {**budget, "generations": n}) for n in (1, 6)]
    monkeypatch.setattr(COMPARE.module, "FEWEST", 64)
    folder, (verdict,) = compare_runs(runs, out=tmp_path, studies=None, samples=64, seed=1)
    assert "generations 6" in verdict
    assert not verdict.startswith("generations 1 is")
    fronts = pd.read_csv(folder / "fronts.csv")
    assert (fronts["designs"] > 0).all()
    assert (fronts["hypervolume [%]"] > 0).any()


def test_runs_are_named_by_options_that_their_study_has():
    options_and_titles = [
        ("front", {"motion": None, "draws": 8}, "study front, motion coupled by default"),
        ("front", {"motion": "prescribed", "draws": 8}, "study front, motion prescribed"),
        ("platform", {"doe": 256}, "study platform"),
    ]
    runs = []
    for study, options, _ in options_and_titles:
        record = {"seed": 1, "arguments": options, "facts": {"motion": "coupled"}}
        entry = RunEntry(Path(study) / "run", record)
        runs.append(ComparedRun(entry=entry, prepared=None, front=None))
    assert configuration_names(runs) == [name for *_, name in options_and_titles]


@pytest.mark.parametrize(
    ("options", "names"),
    [
        ("a", ["option-a 8 draws", "option-a 16 draws", "option-a 8 draws"]),
        ("abcdef", ["front A", "front B", "front A"]),
    ],
)
def test_runs_that_differ_in_much_are_named_by_letters(options, names):
    runs = []
    for draws in (8, 16, 8):
        arguments = {f"option_{letter}_": f"{draws} draws" for letter in options}
        record = {"seed": len(runs), "arguments": arguments, "facts": {}}
        runs.append(ComparedRun(entry=RunEntry(Path("front"), record), prepared=None, front=None))
    assert configuration_names(runs) == names


def copied(run, folder):
    target = folder / run.parent.name / run.name
    shutil.copytree(run, target)
    return target


@pytest.mark.parametrize(
    ("damage", "words"),
    [
        (lambda run: (run / "front.csv").unlink(), "front.csv is missing"),
        (lambda run: (run / "front.csv").write_text("a\n1\n"), "front.csv has been edited"),
        (lambda run: (run / "run.json").write_text("{"), "damaged"),
        (lambda run: (run / "run.json").unlink(), "no run folder"),
    ],
)
def test_a_damaged_run_folder_is_refused_and_nothing_is_left(pair, judged, tmp_path, damage, words):
    run = copied(pair[1], tmp_path)
    damage(run)
    with pytest.raises(InputError, match=words):
        judged([pair[0], run], tmp_path / "results")
    assert not (tmp_path / "results").exists()


def test_runs_that_cannot_be_compared_are_refused(
    pair, compared, springs, studies, judged, tmp_path
):
    elsewhere = springs(platform=studies / "there", generations=1)
    for runs, words in (
        ([pair[0]], "two different runs"),
        ([pair[0], pair[0]], "two different runs"),
        ([pair[0], elsewhere], r"different platforms \(masses.csv differs\)"),
        ([pair[0], springs(springs=4, generations=1)], "different design variables"),
        ([pair[0], compared[0]], "no front study"),
        ([pair[0], tmp_path], "no run folder"),
    ):
        with pytest.raises(InputError, match=words):
            judged(runs, tmp_path / "results")
    with pytest.raises(InputError, match="power of two"):
        judged(pair, tmp_path / "results", samples=512)
    with pytest.raises(InputError, match="--studies"):
        judged(pair, tmp_path / "results", studies=tmp_path)
    masses = studies / "there" / "masses.csv"
    masses.write_text("mass\n6\n")
    with pytest.raises(InputError, match=r"masses\.csv has changed since run"):
        judged([elsewhere, pair[0]], tmp_path / "results")
    assert not (tmp_path / "results").exists()


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("springs, seed=1", "springs, seed=2", "does not give the figures"),
        ("robust: Robust", "levels: Robust", "does not search for a front"),
    ],
)
def test_a_script_of_another_model_is_refused(pair, studies, judged, tmp_path, old, new, words):
    other = tmp_path / "studies"
    shutil.copytree(studies, other)
    (other / "springs.py").write_text(FRONT.replace(old, new))
    before = sorted(pair[0].rglob("*"))
    with pytest.raises(InputError, match=words):
        judged(pair, tmp_path / "results", studies=other)
    assert sorted(pair[0].rglob("*")) == before


def test_list_show_and_the_page_of_all_runs(pair, compared, results, tmp_path):
    listed = call("list", results)
    told = ("five springs", "seed 2", pair[0].name, "(designs found)", "not decided")
    for words in told:
        assert words in listed.output
    page = (results / "index.html").read_text(encoding="utf-8")
    for run in (*pair, compared[0]):
        assert f'href="{run.parent.name}/{run.name}/report.html"' in page
    shown = call("show", pair[0]).output
    for words in ("generations", "designs found", "Versions"):
        assert words in shown
    assert "All files are as the run wrote them." in shown
    edited = copied(pair[0], tmp_path)
    (edited / "front.csv").write_text("")
    assert "front.csv has been edited" in call("show", edited).output
    (edited.parent / "broken").mkdir()
    (edited.parent / "broken" / "run.json").write_text("{")
    assert "damaged" in call("list", tmp_path).output
    assert "damaged" in refresh_overview(tmp_path).read_text(encoding="utf-8")
    assert "`deboom serve" in call("list", tmp_path, "--html", code=2).stderr
    assert len(call("compare", pair[0], code=2).stderr.strip().splitlines()) == 1
