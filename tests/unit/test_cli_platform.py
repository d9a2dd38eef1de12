"""`deboom new platform` and `deboom check`: a folder to fill in, and all its faults at once."""

import re
import shutil
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

from command_line import call
from deboom.errors import InputError
from deboom.files.check import band_in_words, check_platform
from deboom.files.folders import FOLDERS, Names, new_folder
from deboom.files.kinds import FolderKind, FunctionFiles
from deboom.files.platform import DEMONSTRATION, Engine, LoadCaseEntry, read_platform
from deboom.files.platform import PowertrainEntry as Powertrain
from deboom.files.rows import ChannelRow
from deboom.files.schema import _sections, load_toml
from deboom.files.tables import read_table
from deboom.files.uff import UffFunction, read_uff, write_uff
from deboom.mounts.mount import refuse_active_mounts
from deboom.vehicles.coupled_motion import coupled_motion, refuse_reversed_channel

LINES = 20.0 + 2.0 * np.arange(21)


def made(folder, **changes):
    options = {
        "mounts": ("EnM", "Du=left,right"),
        "vehicles": ("wagon", "cabrio"),
        "group": "family",
        "load_cases": ("slow", "fast"),
        "files": FunctionFiles.uff,
    }
    return new_folder(folder, FolderKind.platform, Names(**(options | changes)))


def fill_keys(folder):
    toml = folder / "platform.toml"
    text = re.sub(r"^# (\w+ = .*# FILL IN)", r"\1", toml.read_text(encoding="utf-8"), flags=re.M)
    toml.write_text(text, encoding="utf-8")


def fill_tables(folder):
    mounts = pd.read_excel(folder / "mounts.xlsx", keep_default_na=False)
    places = np.arange(3.0 * len(mounts)).reshape(-1, 3) / 10
    mounts[["x [m]", "y [m]", "z [m]"]] = places
    mounts.to_excel(folder / "mounts.xlsx", index=False)


def filled(folder):
    """Fill in every key and cell, and write the UFF files that its channel table names."""
    fill_keys(folder)
    fill_tables(folder)
    rows = read_table(folder / "channels.xlsx", ChannelRow)
    for node, vehicle in enumerate(("wagon", "cabrio"), 901):
        functions = [function(row, node) for row in rows if row.unit.si == "Pa/N"]
        write_uff(folder / f"noise_transfer/{vehicle}.uff", functions)
    for case in ("slow", "fast"):
        functions = [function(row) for row in rows if row.unit.si != "Pa/N"]
        write_uff(folder / f"operating/{case}.uff", functions)
    return folder


def function(row, ear=None):
    size = {"force": 100.0 + 10.0j, "displacement": 1e-3}.get(row.quantity, 0.01)
    return UffFunction(
        abscissa=LINES,
        values=np.full(LINES.size, complex(size)),
        function_type=4 if ear else 0,
        response_node=ear or row.node,
        response_direction="scalar" if ear else row.direction,
        reference_node=row.node if ear else 0,
        reference_direction=row.direction if ear else "scalar",
        ordinate="pressure" if ear else row.quantity,
        ordinate_unit=row.unit.si.partition("/")[0],
        denominator="force" if ear else "none",
        denominator_unit="N" if ear else "",
    )


def test_the_check_of_a_new_folder_asks_stage_by_stage_for_what_is_empty_and_nothing_else(tmp_path):
    folder = tmp_path / "mine"
    assert call("new", "platform", folder, "--mount", "EnM").stdout.strip().endswith("mine")
    check = check_platform(folder)
    keys = [re.search(r"key '(\w+)'", fault)[1] for fault in check.faults]
    needed = {
        name
        for model in (Engine, Powertrain, LoadCaseEntry)
        for name, field in model.model_fields.items()
        if field.is_required()
    }
    assert set(keys) == needed - {"name", "title", "operating"}
    assert check.waiting[:2] == ("tables", "files of functions")
    fill_keys(folder)
    check = check_platform(folder)
    assert check.waiting[0] == "files of functions"
    assert all(f"column '{axis}'" in fault for axis, fault in zip("xyz", check.faults, strict=True))
    fill_tables(folder)
    check = check_platform(folder)
    assert len(check.waiting) == 1
    told = [fault.removeprefix(f"{folder}/") for fault in check.faults]
    assert [re.match(r"[\w/.-]+", fault)[0] for fault in told] == [
        "noise_transfer/car-1.uff",
        "operating/run-1.uff",
    ]


@pytest.mark.parametrize("files", list(FunctionFiles))
def test_the_folder_has_a_readme_that_names_each_file(tmp_path, files):
    folder = made(tmp_path / "mine", files=files)
    readme = (folder / "README.md").read_text(encoding="utf-8")
    written = {path.relative_to(folder).as_posix() for path in folder.rglob("*") if path.is_file()}
    expected = {"platform.toml", "mounts.xlsx", "channels.xlsx", "README.md"}
    functions = {f"noise_transfer/{name}.{files.value}" for name in ("wagon", "cabrio")}
    functions |= {f"operating/{name}.{files.value}" for name in ("slow", "fast")}
    has_header = files in (FunctionFiles.csv, FunctionFiles.xlsx)
    assert written == expected | (functions if has_header else set())
    assert all(f"`{name}`" in readme for name in (expected | functions) - {"README.md"})


def models_of(model):
    """Models of a file: its own, and those of its sections."""
    return [model, *(each for part in _sections(model).values() for each in models_of(part))]


@pytest.mark.parametrize("kind", list(FolderKind))
def test_every_kind_has_its_keys_in_comments_and_only_asks_for_what_to_fill_in(tmp_path, kind):
    folder = tmp_path / "mine"
    call("new", kind.value, folder, "--mount", "EnM", "--mount", "Du=l,r")
    file, model = FOLDERS[kind].file, FOLDERS[kind].keys
    text = (folder / file).read_text(encoding="utf-8")
    for part in models_of(model):
        for name in part.model_fields:
            assert re.search(rf"^(# )?(\[\[?(\w+\.)?)?{name}\b", text, flags=re.M), name
    missing = call("check", folder, code=2).stderr
    keys = set(re.findall(r"key '(\w+)'[^:]* is missing", missing))
    put = re.sub(rf"^# ((?:{'|'.join(keys)}) = .*# FILL IN)", r"\1", text, flags=re.M)
    (folder / file).write_text(put, encoding="utf-8")
    # keys that others need, once the keys that are always needed are there
    keys |= set(re.findall(r"needs the key '(\w+)'", call("check", folder, code=2).stderr))
    marked = set(re.findall(r"^# (\w+) = .*# FILL IN", text, flags=re.M))
    assert keys == marked - {"cylinders"}  # which an electric drive has not
    put = re.sub(r"^# (\w+ = .*# FILL IN)", r"\1", text, flags=re.M)
    (folder / file).write_text(put, encoding="utf-8")
    load_toml(folder / file, model)
    told = call("check", folder, code=2).stderr
    assert f"{file}:" not in told
    assert re.search(
        r"  1  .*(mounts|sensors|impacts)\.(xlsx|csv).*|compressor_test.toml: key", told
    ), told
    # everything that is commented fits, too
    every = re.sub(r"^# (\w+ = |\[)", r"\1", put, flags=re.M)
    if kind is FolderKind.operation:
        every = re.sub(r"^(record|sample_rate_hz) = ", r"# \1 = ", every, flags=re.M)
    if kind is FolderKind.platform:  # of each pair one key excludes the other
        excluded = "receptance|driving_points|ear_node|other_library"
        every = re.sub(rf"^({excluded}) = ", r"# \1 = ", every, flags=re.M)
    (folder / file).write_text(every, encoding="utf-8")
    load_toml(folder / file, model)


def test_a_filled_folder_is_read_and_summed_up(tmp_path):
    folder = filled(made(tmp_path / "mine"))
    result = call("check", folder)
    assert "2, 6 variables: EnM xyz, Du (left, right) xyz" in result.stdout
    assert "2 in group family: wagon, cabrio" in result.stdout
    assert "21, 20 to 60 Hz, every 2 Hz" in result.stdout
    assert "21 lines in 20 to 60 Hz: 800 to 2400 rpm of order 1.5" in result.stdout
    assert "slow (default)" in result.stdout
    platform = read_platform(folder)
    assert platform.fleet.names == ("wagon", "cabrio")
    assert platform.load_case("fast").total_ratio == 6.2


def changed_toml(folder, *edits):
    toml = folder / "platform.toml"
    text = toml.read_text(encoding="utf-8")
    for old, new in edits:
        assert old in text
        text = text.replace(old, new, 1)
    toml.write_text(text, encoding="utf-8")


def test_all_faults_of_a_stage_are_listed_at_once_each_with_file_item_and_remedy(tmp_path):
    """A folder with faults of every kind: each round lists one stage and mends it for the next."""
    folder = filled(made(tmp_path / "mine"))
    changed_toml(folder, ("cylinders =", "cilinders ="), ("mass_kg = 190.0", "mass_kg = -1"))
    changed_toml(folder, ('_load_case = "slow"', '_load_case = "no"'), ("gear = 3", "gear = 9"))
    channels = pd.read_excel(folder / "channels.xlsx", keep_default_na=False)
    channels.assign(
        unit=["N", *channels["unit"][1:]],
        direction=[channels["direction"][0], "+q", *channels["direction"][2:]],
    ).to_excel(folder / "channels.xlsx", index=False)
    mounts = pd.read_excel(folder / "mounts.xlsx", keep_default_na=False, dtype=str)
    mounts.loc[1, ["y [m]", "piece"]] = ["zero", "wrong"]
    mounts.to_excel(folder / "mounts.xlsx", index=False)
    (folder / "noise_transfer/wagon.uff").unlink()
    cabrio = read_uff(folder / "noise_transfer/cabrio.uff")
    write_uff(folder / "noise_transfer/cabrio.uff", cabrio[2:])
    (folder / "operating/fast.uff").write_bytes(b"no UFF")
    channels.loc[3, "node"] = 77

    def rewrite(name, table):
        return lambda: table.to_excel(folder / name, index=False)

    rounds = [
        (
            (
                "platform.toml: unknown key 'cilinders' in [engine]; did you mean 'cylinders'?",
                "platform.toml: key 'mass_kg' in [powertrain] is -1: input should be greater",
            ),
            lambda: changed_toml(folder, ("cilinders", "cylinders"), ("_kg = -1", "_kg = 190.0")),
        ),
        (
            (
                "platform.toml: default_load_case 'no' is not among the load cases slow, fast",
                "platform.toml: load case 'slow' is in gear 9, but total_ratios",
            ),
            lambda: changed_toml(folder, ('= "no"', '= "slow"'), ("gear = 9", "gear = 3")),
        ),
        (
            (
                "mounts.xlsx line 3, column 'y': 'zero' is no finite number",
                "channels.xlsx line 2: displacement 'EnM x' is in 'N'",
                "channels.xlsx line 3: channel 'EnM y' has direction '+q', which is none",
            ),
            lambda: (
                rewrite("channels.xlsx", channels)(),
                rewrite("mounts.xlsx", mounts.assign(**{"y [m]": "0.1"}))(),
            ),
        ),
        (
            (
                "mounts.xlsx: mount 'Du', piece 'wrong' is not in",
                "mounts.xlsx: no row for mount 'Du', piece 'left'",
            ),
            rewrite(
                "mounts.xlsx", mounts.assign(**{"y [m]": "0.1", "piece": ["", "left", "right"]})
            ),
        ),
        (
            (
                "wagon.uff cannot be read",
                "cabrio.uff: vehicle cabrio: noise transfer function 'ear' per EnM x (node 902",
                "cabrio.uff: vehicle cabrio: noise transfer function 'ear' per EnM y (node 902",
                "slow.uff: load case slow: force 'EnM x' (node 77 +x) is not in it",
                "fast.uff is not a UFF file",
            ),
            lambda: None,
        ),
    ]
    for sentences, mend in rounds:
        result = call("check", folder, code=2)
        assert [result.stderr.count(sentence) for sentence in sentences] == [1] * len(sentences)
        count = int(re.search(r"deboom: (\d+) faults", result.stderr)[1])
        assert count == len(sentences) == len(check_platform(folder).faults), result.stderr
        assert f"{count:3}  " in result.stderr
        assert "; not looked at yet: " in result.stderr
        mend()


def test_an_entry_at_fault_explains_itself_and_is_not_told_again_by_the_tables(tmp_path):
    folder = filled(made(tmp_path / "mine"))
    changed_toml(folder, ('name = "Du"', 'nam = "Du"'), ('"wagon"', '"wa gon"'))
    check = check_platform(folder)
    told = [fault.removeprefix(f"{folder}/platform.toml: ") for fault in check.faults]
    assert told[0] == "unknown key 'nam' in [[mounts]] 2; did you mean 'name'?"
    assert told[1].startswith("key 'name' in [[vehicles]] 1 is \"wa gon\": a name needs")
    assert len(told) == 2
    assert check.waiting[0] == "tables"


def test_more_than_ten_faults_are_all_listed_and_a_refusal_counts_those_that_it_leaves_out(
    tmp_path,
):
    folder = filled(made(tmp_path / "mine"))
    channels = pd.read_excel(folder / "channels.xlsx", keep_default_na=False)
    channels.assign(unit="km/h").to_excel(folder / "channels.xlsx", index=False)
    assert len(check_platform(folder).faults) == len(channels) > 10
    with pytest.raises(InputError, match=rf"\nand {len(channels) - 10} more$"):
        read_platform(folder)


@pytest.mark.parametrize(
    ("name", "content", "waiting"),
    [("platform.toml", b"[", 3), ("mounts.xlsx", b"", 2), ("channels.xlsx", None, 2)],
)
def test_the_check_refuses_what_reading_refuses_and_no_less(tmp_path, name, content, waiting):
    folder = filled(made(tmp_path / "mine"))
    path = folder / name
    kept = path.read_bytes()
    path.unlink()
    if content is not None:
        path.write_bytes(content)
    with pytest.raises(InputError) as caught:
        read_platform(folder)
    check = check_platform(folder)
    assert check.faults == caught.value.sentences
    assert len(check.waiting) == waiting
    path.write_bytes(kept)
    assert check_platform(folder).faults == ()


def test_beyond_reading_signs_are_checked(tmp_path):
    folder = filled(made(tmp_path / "mine"))
    scaled(-1, "force", "fast.uff")(folder)
    (fault,) = check_platform(folder).faults
    assert "load case fast: channel 'EnM x' has a negative stiffness" in fault


def test_frequency_axes_that_differ_are_told_file_by_file(tmp_path):
    folder = filled(made(tmp_path / "mine"))
    for name in ("noise_transfer/cabrio.uff", "operating/slow.uff"):
        path = folder / name
        write_uff(path, [replace(f, abscissa=LINES + 1.0) for f in read_uff(path)])
    faults = check_platform(folder).faults
    assert (
        len([fault for fault in faults if "line 1 is 20 Hz and 21 Hz" in fault]) == len(faults) == 2
    )
    named = {name for fault in faults for name in ("cabrio", "slow") if name in fault}
    assert named == {"cabrio", "slow"}


def scaled(factor, kind, files="*.uff"):
    """Write the functions of a kind with another factor."""

    def fault(folder):
        for path in folder.rglob(files):
            functions = [
                replace(f, values=factor * f.values) if f.ordinate == kind else f
                for f in read_uff(path)
            ]
            write_uff(path, functions)

    return fault


@pytest.mark.parametrize(
    ("fault", "warned"),
    [
        (lambda _: None, set()),
        (scaled(1000, "pressure"), {"noise transfer function", "level"}),
        (scaled(1000, "displacement"), {"displacement", "stiffness"}),
        (scaled(1e-3, "displacement"), {"stiffness"}),
        (scaled(1000, "force"), {"force", "stiffness", "level"}),
    ],
)
def test_a_wrong_unit_shows_in_the_summary(tmp_path, fault, warned):
    folder = filled(made(tmp_path / "mine"))
    fault(folder)
    result = call("check", folder)
    lines = [line for line in result.stdout.splitlines() if " (usual " in line]
    assert len(lines) == 6
    told = [line for line in lines if "WARNING, unusual: is a unit wrong?" in line]
    assert {re.split("  +", line)[0] for line in told} == warned


def millimetres(folder):
    mounts = pd.read_excel(folder / "mounts.xlsx", keep_default_na=False)
    mounts.loc[1, "x [m]"] = 428.0
    mounts.to_excel(folder / "mounts.xlsx", index=False)


def torque(folder):
    rows = "\n".join(f"{line},1e308" for line in LINES)
    (folder / "t.csv").write_text(f"frequency [Hz],engine torque [N m]\n{rows}\n")
    toml = (folder / "platform.toml").read_text()
    case = 'operating = "operating/slow.uff"'
    (folder / "platform.toml").write_text(toml.replace(case, f'{case}\ntorque_table = "t.csv"'))


@pytest.mark.parametrize(
    ("fault", "sentence"),
    [
        (millimetres, "mounts.xlsx line 3: its position is up to 428 m, and none is above 50 m"),
        (scaled(1e200, "pressure"), "per EnM x: its noise transfer function is up to 1e+198 Pa/N"),
        (scaled(0.0, "pressure"), "'EnM x' is 0 at all lines: measure it again, or take the axis"),
        (torque, "t.csv: its engine torque is up to 1e+308 N m, and none is above 100000 N m: is"),
        (scaled(1e5, "displacement"), "'EnM x': its displacement is up to 100 m, and none is abov"),
    ],
)
def test_what_no_car_has_is_refused(tmp_path, fault, sentence):
    folder = filled(made(tmp_path / "mine"))
    fault(folder)
    assert sentence in call("check", folder, code=2).stderr


PLATFORM = ("new", "platform", "mine")


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        ((*PLATFORM, "--mount", "a b"), "mount 'a b': a name needs at least one character, no bla"),
        ((*PLATFORM, "--vehicle", "../x"), "vehicle '../x'"),
        ((*PLATFORM, "--vehicle", "A", "--vehicle", "a"), "vehicle 'a' beside 'A' differs in cap"),
        ((*PLATFORM, "--mount", "Du=left"), "name two pieces or more"),
        ((*PLATFORM, "--mount", "Du=l,l"), "two of piece of Du are named 'l'"),
        ((*PLATFORM, "--load-case", ""), "load case ''"),
        ((*PLATFORM, "--group", "a b"), "group 'a b'"),
        (("new", "campaign", "mine", "--vehicle", "v"), "--load-case belong to a platform"),
        (("new", "platform", "."), "is there already: name a new folder"),
        (("check", "."), "holds none of platform.toml, campaign.toml, vehicle.toml, car.toml"),
        (("check", "none"), "there is no such folder: `deboom new KIND"),
    ],
)
def test_bad_calls_are_refused_and_nothing_is_written(tmp_path, monkeypatch, words, sentence):
    monkeypatch.chdir(tmp_path)
    assert sentence in call(*words, code=2).stderr
    assert list(tmp_path.iterdir()) == []


def test_nothing_is_left_of_a_folder_that_could_not_be_finished(tmp_path, monkeypatch):
    def fail(*_args):
        raise OSError("disk full")

    monkeypatch.setattr("deboom.files.folders.workbook_bytes", fail)
    with pytest.raises(InputError, match="cannot be written"):
        made(tmp_path / "mine")
    assert list(tmp_path.iterdir()) == []


def turned(case, channel):
    """Return a run with one channel reversed in displacement and in force."""
    sign = np.where(np.array(case.force.channels) == channel, -1.0, 1.0)
    both = {
        name: replace(getattr(case, name), values=getattr(case, name).values * sign)
        for name in ("displacement", "force")
    }
    return replace(case, **both)


@pytest.fixture(scope="module")
def shipped():
    return read_platform(DEMONSTRATION)


@pytest.mark.parametrize("mount", ["EnM", "GeM", "TSM"])
def test_a_channel_reversed_in_displacement_and_force_is_named(shipped, mount):
    """Mounts stay passive; only the rigid powertrain that all of them hold tells."""
    for case in shipped.load_cases:
        refuse_reversed_channel(shipped.mounts, case)
        refuse_active_mounts(turned(case, f"{mount} z"))
        with pytest.raises(InputError, match=f"with '{mount} z' reversed [0-9.]+ % are left"):
            refuse_reversed_channel(shipped.mounts, turned(case, f"{mount} z"))


def test_check_and_coupled_motion_name_the_reversed_channel(shipped, tmp_path):
    folder = shutil.copytree(DEMONSTRATION, tmp_path / "u06")
    rows = read_table(folder / "channels.csv", ChannelRow)
    (node,) = {row.node for row in rows if row.channel == "TSM z" and row.quantity == "force"}
    for path in (folder / "operating").glob("*.uff"):
        functions = [
            replace(function, values=-function.values)
            if (function.response_node, function.response_direction) == (node, "+z")
            else function
            for function in read_uff(path)
        ]
        write_uff(path, functions, binary=True)
    sentences = call("check", folder, code=2).stderr.splitlines()
    named = [line for line in sentences if "with 'TSM z' reversed" in line]
    assert len(named) == len(shipped.load_cases)
    case = turned(shipped.load_cases[0], "TSM z")
    with pytest.raises(InputError, match="with 'TSM z' reversed"):
        coupled_motion(shipped.fleet, shipped.mounts, shipped.powertrain, case)


def test_positions_that_are_wrong_accuse_no_channel(shipped):
    moved = [
        replace(mount, positions=tuple((y, z, x) for x, y, z in mount.positions))
        for mount in shipped.mounts
    ]
    for case in shipped.load_cases:
        refuse_reversed_channel(moved, case)
    with pytest.raises(InputError, match="check the positions, axes and signs of its mounts"):
        coupled_motion(shipped.fleet, moved, shipped.powertrain, shipped.load_cases[0])


def on_lines(platform, lines):
    """Return the platform's first run on other lines, nothing else is looked at."""
    lines = np.asarray(lines)
    case = platform.load_cases[0]
    values = np.zeros((lines.size, len(case.force.channels)), dtype=complex)
    force = replace(case.force, frequency=lines, values=values)
    torque = np.zeros(lines.size)
    displacement = replace(force, unit="m")
    case = replace(case, displacement=displacement, force=force, engine_torque=torque)
    return replace(platform, load_cases=(case,))


@pytest.mark.parametrize(
    ("lines", "band"),
    [
        (20.508 + 0.7324 * np.arange(82), (20.0, 60.0)),
        (20.0 + 0.7324 * np.arange(55), (20.0, 60.0)),
        (np.arange(20.0, 61.0), (20.0, 60.0)),
        (20.74 + 0.7324 * np.arange(82), (20.74, 20.74 + 0.7324 * 81)),
        (np.arange(20.0, 60.0), (20.0, 59.0)),
        (np.array([30.0]), (30.0, 30.0)),
    ],
)
def test_data_that_miss_an_edge_by_less_than_a_line_keep_the_band(shipped, lines, band):
    platform = on_lines(shipped, lines)
    assert platform.band == pytest.approx(band)
    words = band_in_words(platform, platform.band)
    assert bool(words) == (band != (20.0, 60.0))
    if words:
        assert f"from {band[0]:g} to {band[1]:g} Hz instead of the usual 20 to 60 Hz" in words


def test_the_demonstration_is_checked_by_its_name():
    assert "5 in group U06: U06-1" in call("check", "u06").stdout
