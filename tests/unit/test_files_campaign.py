"""Campaign folders: reading, tables, new runs, refusals."""

import shutil
from dataclasses import replace
from pathlib import Path
from typing import Annotated

import numpy as np
import pandas as pd
import pytest
from pydantic import Field

from deboom.bench.campaign_plan import CampaignPlan, TimeRunPlan
from deboom.bench.campaign_writer import write_campaign
from deboom.bench.operating_run import PlannedRun
from deboom.errors import InputError
from deboom.files import campaign as campaign_new_run
from deboom.files.campaign import add_operating_run, new_run_file, read_campaign, read_time_run
from deboom.files.rows import SensorRow, read_curve, read_table, write_curve, write_table
from deboom.files.schema import StrictModel, dump_toml, load_toml
from deboom.files.tables import read_rows
from deboom.files.uff import read_uff, write_uff
from deboom.measurement.sensors import SensorKind

RUNS = (
    PlannedRun(5, 220.0, full_load=True),
    PlannedRun(5, 100.0, full_load=False, rising=False),
)
PLAN = CampaignPlan(
    ("M1", "M2"),
    RUNS,
    shaker_repeats=1,
    time_run=TimeRunPlan(last_speed=1520.0, duration=0.25),
    frequency=np.linspace(20.0, 80.0, 25),
)


@pytest.fixture(scope="module")
def written(tmp_path_factory):
    return write_campaign(tmp_path_factory.mktemp("campaign") / "good", 1, PLAN)


@pytest.fixture
def copy(written, tmp_path):
    return shutil.copytree(written, tmp_path / "copy")


def replace_text(folder, name, old, new, count=1):
    text = (folder / name).read_text(encoding="utf-8")
    assert old in text
    (folder / name).write_text(text.replace(old, new, count), encoding="utf-8")


def drop_tables(folder, section, wanted):
    """Remove the [[section]] tables of campaign.toml whose text holds `wanted`."""
    path = folder / "campaign.toml"
    blocks = path.read_text(encoding="utf-8").split("\n\n")
    kept = [b for b in blocks if not (b.startswith(f"[[{section}]]") and wanted in b)]
    assert len(kept) < len(blocks)
    path.write_text("\n\n".join(kept) + "\n", encoding="utf-8")


def drop_lines(folder, name, start):
    path = folder / name
    lines = path.read_text(encoding="utf-8").splitlines(keepends=True)
    kept = [line for line in lines if not line.startswith(start)]
    assert len(kept) < len(lines)
    path.write_text("".join(kept), encoding="utf-8")


def rewrite(path, change):
    functions = change(list(read_uff(path)))
    write_uff(path, functions, binary=True)


def test_everything_is_there_in_si(written):
    campaign = read_campaign(written)
    assert campaign.name == "virtual_bench_1"
    assert campaign.mount_sets == ("M1", "M2")
    assert campaign.powertrain_mounts == ("EnM", "GeM", "TSM")
    assert [mount.pieces for mount in campaign.mounts][-1] == ("left", "right")
    assert len(campaign.runs) == 4
    assert len(campaign.shaker_runs) == 9
    assert len(campaign.static_curves) == 20
    assert campaign.order == 1.5
    assert campaign.tolerances.sensor_position == 0.002
    assert campaign.tolerances.shaker_angle == pytest.approx(np.deg2rad(0.5))
    assert all(path.is_file() for path in campaign.input_files)
    powertrain = campaign.sensors_of(SensorKind.ACCELEROMETER, campaign.powertrain_mounts)
    assert [sensor.name for sensor in powertrain] == ["A1", "A2", "A3", "A4", "A5", "A6"]
    assert len(campaign.sensors_of(SensorKind.FORCE_CELL, ("TSM",))) == 2
    assert len(campaign.sensors_of(SensorKind.FORCE_CELL, ("Du",), "left")) == 1
    rising, falling = campaign.runs_of("M2")
    assert rising.rising
    assert rising.full_load
    assert rising.total_ratio == 3.4
    assert not falling.rising
    assert not falling.full_load
    assert falling.torque_limit == 100.0
    assert falling.engine_torque == pytest.approx(100.0, abs=5.0)
    assert falling.wheel_torque == pytest.approx(340.0, abs=17.0)
    assert rising.acceleration.channels[:4] == ("A1 x", "A1 y", "A1 z", "A2 x")
    assert rising.frequency == pytest.approx(PLAN.frequency)
    shaker = campaign.shaker_runs[0]
    assert shaker.response.inputs == ("EnM x",)
    assert shaker.response.outputs == ("C1 x", "C1 y", "C1 z", "C2 x", "C2 y", "C2 z")


def test_chosen_mount_sets_alone_are_read(written):
    campaign = read_campaign(written, mount_sets=["M2"])
    assert {run.mount_set for run in campaign.runs} == {"M2"}
    assert {curve.mount_set for curve in campaign.static_curves} == {"M2"}
    assert not any("M1" in path.parts for path in campaign.input_files)
    with pytest.raises(InputError, match="there is no mount set 'M7', use M1, M2"):
        read_campaign(written, mount_sets=["M7"])
    with pytest.raises(InputError, match="there is no mount set 'M1', use M2"):
        campaign.runs_of("M1")


def test_units_and_signs_of_the_tables_count(copy):
    before = read_campaign(copy)
    table = pd.read_csv(copy / "sensors.csv", keep_default_na=False)
    for axis in "xyz":
        table[f"{axis} [mm]"] = 1e3 * table.pop(f"{axis} [m]")
        table[f"r{axis} [rad]"] = np.deg2rad(table.pop(f"r{axis} [deg]"))
    table.to_csv(copy / "sensors.csv", index=False)
    replace_text(copy, "channels.csv", "A1 x,acceleration,1,+x", "A1 x,acceleration,1,-x")
    for path in sorted((copy / "runs").rglob("*.uff")):
        rewrite(path, lambda functions: [turned(f) for f in functions])
    after = read_campaign(copy)
    for one, other in zip(before.sensors, after.sensors, strict=True):
        assert other.position == pytest.approx(one.position)
        assert other.orientation == pytest.approx(one.orientation)
    for one, other in zip(before.runs, after.runs, strict=True):
        assert other.acceleration.values[:, 0] == pytest.approx(-one.acceleration.values[:, 0])
        assert other.acceleration.values[:, 1:] == pytest.approx(one.acceleration.values[:, 1:])


def turned(function):
    """Call the first accelerometer's x channel -x."""
    if (function.response_node, function.response_direction) != (1, "+x"):
        return function
    fields = {name: getattr(function, name) for name in type(function).__dataclass_fields__}
    return type(function)(**fields | {"response_direction": "-x"})


def test_an_excel_position_sheet_is_the_same(copy):
    before = read_campaign(copy)
    table = pd.read_csv(copy / "sensors.csv", keep_default_na=False)
    table.to_excel(copy / "sensors.xlsx", index=False)
    replace_text(copy, "campaign.toml", '"sensors.csv"', '"sensors.xlsx"')
    after = read_campaign(copy)
    assert copy / "sensors.xlsx" in after.input_files
    for one, other in zip(before.sensors, after.sensors, strict=True):
        assert (one.name, one.kind, one.piece) == (other.name, other.kind, other.piece)
        assert other.position == pytest.approx(one.position)
        assert other.orientation == pytest.approx(one.orientation)


def test_switched_off_channels_may_be_dead_or_missing(copy):
    replace_text(copy, "campaign.toml", "switched_off = []", 'switched_off = ["A3 y"]')
    drop_lines(copy, "channels.csv", "A3 y")
    campaign = read_campaign(copy, switched_off=["A4 z", "A3 y"])
    assert campaign.switched_off == ("A3 y", "A4 z")
    channels = campaign.runs[0].acceleration.channels
    assert "A3 y" not in channels
    assert "A4 z" in channels


def test_a_time_run_is_read_by_name(written):
    run = read_time_run(written, "g5_wot220_time")
    assert run.acceleration.shape == (4096, 24)
    assert run.pulses_per_revolution == 2
    assert run.order == 1.5
    with pytest.raises(InputError, match="there is no time run 'other', use g5_wot220_time"):
        read_time_run(written, "other")


TOML = "campaign.toml"
RUN = "runs/M1/g5_wot220.uff"

WRONG_TABLES = {
    "no campaign file": (
        lambda f: (f / TOML).unlink(),
        "campaign.toml cannot be read",
    ),
    "an unknown key": (
        lambda f: replace_text(f, TOML, "rising = true", "risin = true"),
        r"unknown key 'risin' in \[\[runs\]\] 1; did you mean 'rising'\?",
    ),
    "a gear without ratio": (
        lambda f: replace_text(f, TOML, "gear = 5", "gear = 9"),
        "run 'g5_wot220' is in gear 9, but total_ratios",
    ),
    "a run twice": (
        lambda f: replace_text(f, TOML, "g5_slice100_falling", "g5_wot220"),
        r"two \[\[runs\]\] of one mount set are named 'M1 g5_wot220'",
    ),
    "a shaker run at no mount": (
        lambda f: replace_text(f, TOML, 'mount = "EnM"\npiece', 'mount = "XnM"\npiece'),
        "shaker run at mount 'XnM'",
    ),
    "a curve of no mount": (
        lambda f: replace_text(f, TOML, 'mount = "EnM"\naxis', 'mount = "XnM"\naxis'),
        "static curve of mount 'XnM'",
    ),
    "no runs": (
        lambda f: drop_tables(f, "runs", ""),
        r"no \[\[runs\]\]: add at least one",
    ),
    "the shaker along one axis only": (
        lambda f: [drop_tables(f, "shaker_runs", f'GeM"\npiece = ""\naxis = "{a}"') for a in "xz"],
        "mount 'GeM' has shaker runs along y only: add x, z",
    ),
    "fewer than three accelerometers": (
        lambda f: (
            [drop_lines(f, "sensors.csv", f"A{n},") for n in (1, 3, 5, 6)]
            + [drop_lines(f, "channels.csv", f"A{n} ") for n in (1, 3, 5, 6)]
        ),
        "2 usable accelerometers on the powertrain, fewer than three",
    ),
    "a wishbone without accelerometer": (
        lambda f: [drop_lines(f, "sensors.csv", "A7,"), drop_lines(f, "channels.csv", "A7 ")],
        "mount 'Du left' carries a body of its own, which has no usable accelerometer",
    ),
    "a mount without cell": (
        lambda f: [drop_lines(f, "sensors.csv", "C8,"), drop_lines(f, "channels.csv", "C8 ")],
        "mount 'Du right' has no force cell",
    ),
    "a sensor at no mount": (
        lambda f: replace_text(f, "sensors.csv", "B&K 4321,EnM", "B&K 4321,XnM"),
        "sensor 'A1' is at mount 'XnM'",
    ),
    "a sensor of no kind": (
        lambda f: replace_text(f, "sensors.csv", "accelerometer", "microphone"),
        "sensors.csv line 2: sensor 'A1' is of unknown kind 'microphone'",
    ),
    "a sensor twice": (
        lambda f: replace_text(f, "sensors.csv", "\nA2,", "\nA1,"),
        "sensors.csv line 3: sensor 'A1' already stands in line 2",
    ),
    "a length without unit": (
        lambda f: replace_text(f, "sensors.csv", "y [m]", "y"),
        r"column 'y' has no unit: write 'y \[mm\]' or \[m\]",
    ),
    "an angle without unit": (
        lambda f: replace_text(f, "sensors.csv", "ry [deg]", "ry"),
        r"column 'ry' has no unit: write 'ry \[deg\]' or \[rad\]",
    ),
    "an angle in mm": (
        lambda f: replace_text(f, "sensors.csv", "ry [deg]", "ry [mm]"),
        r"column 'ry \[mm\]': an angle is in deg or rad",
    ),
    "lengths in two units": (
        lambda f: replace_text(f, "sensors.csv", "y [m]", "y [mm]"),
        "units are mixed: 'x' is in m and 'y' in mm",
    ),
    "accelerations in two units": (
        lambda f: replace_text(
            f, "channels.csv", "A2 x,acceleration,2,+x,m/s^2", "A2 x,acceleration,2,+x,g"
        ),
        r"line 5: units are mixed: acceleration 'A1 x' is in m/s\^2 and 'A2 x' in g",
    ),
    "an acceleration in newton": (
        lambda f: replace_text(f, "channels.csv", "1,+x,m/s^2", "1,+x,N"),
        "acceleration 'A1 x' is in 'N', which is no unit of it",
    ),
    "swapped axes": (
        lambda f: replace_text(
            f, "channels.csv", "A1 x,acceleration,1,+x", "A1 x,acceleration,1,+y"
        ),
        r"acceleration 'A1 x' has direction '\+y', which is not along 'x': two axes may be swapped",
    ),
    "a doubled channel": (
        lambda f: replace_text(
            f, "channels.csv", "A1 y,acceleration,1,+y", "A1 x,acceleration,1,+x"
        ),
        "line 3: acceleration 'A1 x' already stands in line 2",
    ),
    "a doubled DoF": (
        lambda f: replace_text(f, "channels.csv", "A2 x,acceleration,2", "A2 x,acceleration,1"),
        "line 5: acceleration at node 1 along x already stands in line 2",
    ),
    "a channel of no sensor": (
        lambda f: replace_text(f, "channels.csv", "A1 x,", "A99 x,"),
        "acceleration channel 'A99 x' fits no accelerometer",
    ),
    "a channel that is missing": (
        lambda f: drop_lines(f, "channels.csv", "A1 x,"),
        "there is no acceleration channel 'A1 x': add its row, or name it in switched_off",
    ),
    "an unknown quantity": (
        lambda f: replace_text(f, "channels.csv", "x,acceleration", "x,speed"),
        "line 2: unknown quantity 'speed'",
    ),
    "no tacho": (
        lambda f: drop_lines(f, "channels.csv", "engine speed,"),
        "0 channels of quantity 'engine speed', expected one: a run without it has no phase",
    ),
    "no engine torque": (
        lambda f: drop_lines(f, "channels.csv", "engine torque,"),
        "0 channels of quantity 'engine torque'",
    ),
    "no tacho signal": (
        lambda f: drop_lines(f, "channels.csv", "tacho,"),
        "0 channels of quantity 'tacho', expected one: a run without it has no order",
    ),
    "an unknown channel switched off": (
        lambda f: replace_text(f, TOML, "switched_off = []", 'switched_off = ["A9 q"]'),
        "switched_off names 'A9 q', which is no channel",
    ),
    "a cell switched off": (
        lambda f: replace_text(f, TOML, "switched_off = []", 'switched_off = ["C1 x"]'),
        "switched_off names 'C1 x', a force cell",
    ),
    "a mount without position": (
        lambda f: drop_lines(f, "mounts.csv", "TSM,"),
        "mounts.csv: mount 'TSM', piece '' is missing",
    ),
    "a position without mount": (
        lambda f: replace_text(f, "mounts.csv", "TSM,", "CTSM,"),
        "campaign.toml: mount 'CTSM', piece '' is missing",
    ),
    "a tolerance below 0": (
        lambda f: replace_text(f, TOML, "torque_nm = 1.0", "torque_nm = -1.0"),
        r"key 'torque_nm' in \[tolerances\] is -1.0",
    ),
    "a node that is none": (
        lambda f: replace_text(f, "channels.csv", "acceleration,1,+x", "acceleration,1.5,+x"),
        "node '1.5' is no whole number from 1",
    ),
    "a direction that is none": (
        lambda f: replace_text(f, "channels.csv", "acceleration,1,+x", "acceleration,1,up"),
        "channel 'A1 x' has direction 'up', which is none",
    ),
    "a deflection that is no number": (
        lambda f: replace_text(f, "static_curves/M1/TSM_x.csv", "-15.0", "a"),
        "TSM_x.csv line 2, column 'deflection': 'a' is no finite number",
    ),
}


@pytest.mark.parametrize("case", WRONG_TABLES)
def test_wrong_tables_are_refused_with_a_sentence(copy, case):
    damage, says = WRONG_TABLES[case]
    damage(copy)
    with pytest.raises(InputError, match=says):
        read_campaign(copy)


def without(node, direction):
    return lambda functions: [
        f for f in functions if (f.response_node, f.response_direction) != (node, direction)
    ]


def changed(node, direction, **new):
    def change(functions):
        out = []
        for f in functions:
            if (f.response_node, f.response_direction) == (node, direction):
                values = {name: getattr(f, name) for name in type(f).__dataclass_fields__}
                f = type(f)(**values | {k: v(f) if callable(v) else v for k, v in new.items()})
            out.append(f)
        return out

    return change


def half_missed(function):
    speed = np.array(function.values)
    speed[-3:] /= 2
    return speed


WRONG_RUNS = {
    "a missing channel": (
        RUN,
        without(3, "+z"),
        r"run 'g5_wot220' of M1: acceleration 'A3 z' \(node 3 \+z\) is not in it",
    ),
    "a doubled channel": (
        RUN,
        lambda functions: [*functions, functions[0]],
        r"acceleration 'A1 x' \(node 1 \+x\) is in it 2 times",
    ),
    "no tacho in the run": (
        RUN,
        without(201, "scalar"),
        "engine speed 'engine speed' .* is not in it",
    ),
    "missing tacho pulses": (
        RUN,
        changed(201, "scalar", values=half_missed),
        "the tacho reads 1500 rpm at 75 Hz, which is not order 1.5: a pulse may be missing",
    ),
    "a dead accelerometer": (
        RUN,
        changed(2, "+y", values=lambda f: np.zeros_like(f.values)),
        "acceleration 'A2 y' is dead, 0 at all lines: name it in switched_off",
    ),
    "an amplitude without phase": (
        RUN,
        changed(2, "+y", values=lambda f: np.abs(f.values)),
        "acceleration 'A2 y' is real: export real and imaginary part",
    ),
    "a complex torque": (
        RUN,
        changed(201, "+ry", values=lambda f: f.values + 1j),
        "engine torque 'engine torque' is complex: export it as real values",
    ),
    "another order": (
        RUN,
        changed(2, "+y", id_lines=("order 3",)),
        "is of order 3, not of order 1.5",
    ),
    "other lines": (
        RUN,
        changed(2, "+y", abscissa=lambda f: f.abscissa + 1.0),
        "the axes of node 1 .x acceleration and node 2 .y acceleration differ",
    ),
    "a transfer function": (
        RUN,
        changed(2, "+y", function_type=4),
        "acceleration 'A2 y' has UFF function type 4: export it as 0 or 12 or 27",
    ),
    "a shaker pushing elsewhere": (
        "shaker/GeM_x_1.uff",
        lambda functions: changed_reference(functions, "+y"),
        r"shaker run 'GeM x' 1: its reference is force along '\+y', expected one force along 'x'",
    ),
}


def changed_reference(functions, direction):
    out = []
    for f in functions:
        values = {name: getattr(f, name) for name in type(f).__dataclass_fields__}
        out.append(type(f)(**values | {"reference_direction": direction}))
    return out


@pytest.mark.parametrize("case", WRONG_RUNS)
def test_wrong_runs_are_refused_with_a_sentence(copy, case):
    name, change, says = WRONG_RUNS[case]
    rewrite(copy / name, change)
    with pytest.raises(InputError, match=says):
        read_campaign(copy)


def test_a_shaker_that_pulls_turns_the_sign(copy):
    before = read_campaign(copy).shaker_runs[0].response.values
    rewrite(copy / "shaker/EnM_x_1.uff", lambda functions: changed_reference(functions, "-x"))
    after = read_campaign(copy).shaker_runs[0].response.values
    assert after == pytest.approx(-before)


def test_another_unit_in_the_file_than_in_the_table_is_refused(copy):
    table = (copy / "channels.csv").read_text(encoding="utf-8")
    (copy / "channels.csv").write_text(table.replace("m/s^2", "g"), encoding="utf-8")
    with pytest.raises(InputError, match=r"is in 'm/s\^2', but the channel table says 'g'"):
        read_campaign(copy)


LINES = np.arange(30.0, 40.5, 1.0)


@pytest.fixture(scope="module")
def written_2(tmp_path_factory):
    folder = tmp_path_factory.mktemp("bench") / "campaign"
    plan = CampaignPlan(("M1",), (PlannedRun(5, 220.0, True),), 1, frequency=LINES)
    return write_campaign(folder, 1, plan)


@pytest.fixture
def folder(written_2, tmp_path):
    return Path(shutil.copytree(written_2, tmp_path / "campaign"))


@pytest.fixture
def run(written_2):
    return replace(read_campaign(written_2).runs[0], name="again", gear=6)


def files(folder):
    return {
        path.relative_to(folder).as_posix(): path.read_bytes()
        for path in folder.rglob("*")
        if path.is_file()
    }


def edited(path, old, new):
    text = path.read_bytes().decode("utf-8")
    assert old in text
    path.write_bytes(text.replace(old, new).encode("utf-8"))


def without_rows(path, start):
    rows = path.read_text(encoding="utf-8").splitlines(keepends=True)
    path.write_text("".join(r for r in rows if not r.startswith(start)), encoding="utf-8")


def test_a_new_run_reads_back_as_it_was_and_comments_stay(folder, run):
    edited(folder / TOML, "[engine]", "# weighed twice\n[engine]")
    place = add_operating_run(folder, run, ("from elsewhere", "x" * 100))
    assert place == folder / "runs" / "M1" / "again.uff"
    assert "# weighed twice" in (folder / TOML).read_text(encoding="utf-8")
    found = read_campaign(folder).runs[-1]
    assert (found.name, found.gear, found.rising) == ("again", 6, True)
    for name in ("engine_torque", "static_force"):
        assert np.array_equal(getattr(found, name), getattr(run, name))
    for name in ("acceleration", "cell_force"):
        assert np.array_equal(getattr(found, name).values, getattr(run, name).values)


def test_channels_in_other_units_and_against_their_axes_read_back_the_same(folder, run):
    table = folder / "channels.csv"
    rows = [
        row.replace("+x", "-x").replace("m/s^2", "g") if ",acceleration," in row else row
        for row in table.read_text(encoding="utf-8").splitlines()
    ]
    table.write_text("\n".join(rows) + "\n", encoding="utf-8")
    # the run that is there is in m/s^2 still: only the new one is asked for
    edited(folder / TOML, "[[runs]]", "[[time_runs]]\npulses_per_revolution = 2")
    add_operating_run(folder, run)
    (found,) = read_campaign(folder).runs
    assert found.acceleration.values == pytest.approx(run.acceleration.values)


@pytest.mark.parametrize(
    ("change", "spoil", "message"),
    [
        ({"name": "g5_wot220"}, None, "run 'g5_wot220' of mount set M1 is there already"),
        ({"name": "a b"}, None, "'a b' is no name of a run"),
        ({"name": "../out"}, None, "is no name of a run"),
        ({"static_force_names": ("TSM x",), "static_force": np.zeros((11, 1))}, None, "no static"),
        ({}, lambda f: (f / "runs/M1/again.uff").write_bytes(b"x"), "though no run of"),
        (
            {},
            lambda f: without_rows(f / "channels.csv", "engine speed"),
            "add its row",
        ),
    ],
)
def test_what_does_not_fit_is_refused_and_nothing_changes(folder, run, change, spoil, message):
    if spoil is not None:
        spoil(folder)
    before = files(folder)
    with pytest.raises(InputError, match=message):
        add_operating_run(folder, replace(run, **change))
    assert files(folder) == before


def test_a_dead_channel_is_refused_and_nothing_changes(folder, run):
    values = np.array(run.acceleration.values)
    values[:, 3] = 0
    before = files(folder)
    with pytest.raises(InputError, match="is dead"):
        add_operating_run(
            folder, replace(run, acceleration=replace(run.acceleration, values=values))
        )
    assert files(folder) == before


def test_runs_in_another_form_are_refused_and_nothing_changes(folder, run, monkeypatch):
    path = folder / TOML
    monkeypatch.setattr(campaign_new_run, "write_uff", lambda path, *_, **__: path.touch())
    monkeypatch.setattr(campaign_new_run, "_check_new_run", lambda *_: None)
    text = path.read_text(encoding="utf-8")
    start, end = text.index("[[runs]]"), text.index("[[shaker_runs]]")
    inline = ", ".join(text[start:end].splitlines()[1:-1])
    path.write_text(
        text[:start].replace("[engine]", f"runs = [{{{inline}}}]\n[engine]") + text[end:],
        encoding="utf-8",
    )
    assert len(read_campaign(folder).runs) == 1
    before = files(folder)
    with pytest.raises(InputError, match=r"write the list as \[\[runs\]\] sections"):
        add_operating_run(folder, run)
    assert files(folder) == before


def test_the_place_of_a_new_run_is_told_before_any_work(folder):
    assert new_run_file(folder, "M1", "new") == folder / "runs" / "M1" / "new.uff"
    with pytest.raises(InputError, match="is there already"):
        new_run_file(folder, "M1", "g5_wot220")


ROWS = (
    SensorRow("A1", "accelerometer", "B&K 4321", "EnM", "", (0.1, -0.2, 0.3), (0.0, 0.1, 1.5)),
    SensorRow("C7", "force cell", "Kistler 9077C", "Du", "left", (1.0, 2.0, 3.0), (0.0, 0.0, -1.0)),
)


@pytest.mark.parametrize("suffix", [".csv", ".xlsx"])
def test_position_sheets_read_back(tmp_path, suffix):
    path = tmp_path / f"sensors{suffix}"
    write_table(path, SensorRow, ROWS)
    for one, other in zip(ROWS, read_table(path, SensorRow), strict=True):
        assert (one.sensor, one.kind, one.model, one.mount, one.piece) == (
            *(other.sensor, other.kind, other.model, other.mount, other.piece),
        )
        assert other.position == pytest.approx(one.position, rel=1e-12)
        assert other.angles == pytest.approx(one.angles, rel=1e-9)


def test_curves_read_back(tmp_path):
    deflection, force = np.linspace(-1e-3, 1e-3, 5), np.linspace(-80.0, 90.0, 5)
    write_curve(tmp_path / "curve.csv", deflection, force)
    assert (tmp_path / "curve.csv").read_text().startswith("deflection [mm],force [N]\n-1.0,")
    found = read_curve(tmp_path / "curve.csv")
    assert found[0] == pytest.approx(deflection, rel=1e-14)
    assert found[1] == pytest.approx(force, rel=1e-14)


WRONG_TABLES_3 = {
    "": "is empty",
    "name,x [mm]\n": "has a header and no rows",
    "name,x [mm]\n\n,\n": "has a header and no rows",
    "name\nA\n": "column 'x' is missing; the columns are name, x, separated by commas",
    "name,x [mm],x [mm]\nA,1,2\n": "column 'x' is unknown or doubled",
    "name,x [mm],z\nA,1,2\n": "column 'z' is unknown or doubled",
    "name,x [mm]\n,1\n": "line 2: column 'name' is empty",
    "name,x [mm]\nA,\n": "line 2, column 'x': '' is no finite number",
    'name,x [mm]\nA,"1,5"\n': "line 2, column 'x': '1,5' is no finite number",
    "name,x [mm]\n\nA,nan\n": "line 3, column 'x': 'nan' is no finite number",
    "name,x [inch]\nA,1\n": r"column 'x \[inch\]': unknown unit 'inch'",
    "name,x [N]\nA,1\n": r"column 'x \[N\]' is not in m or a multiple",
    "name,x [mm]\nA,1,2,3\n": "is no comma-separated table",
}


def numbers_of(path):
    rows = read_rows(path, ("name",), {"x": "m"})
    return {row.filled("name"): row.number("x") for row in rows}


@pytest.mark.parametrize("text", WRONG_TABLES_3)
def test_wrong_tables_are_refused(tmp_path, text):
    path = tmp_path / "table.csv"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(InputError, match=WRONG_TABLES_3[text]):
        numbers_of(path)


def test_files_that_are_no_table_are_refused(tmp_path):
    with pytest.raises(InputError, match="cannot be read"):
        read_rows(tmp_path / "none.csv", ("name",), {})
    (tmp_path / "bytes.csv").write_bytes(b"name\n\xff\xfe\n")
    with pytest.raises(InputError, match="is not UTF-8 text"):
        read_rows(tmp_path / "bytes.csv", ("name",), {})
    (tmp_path / "text.xlsx").write_text("name\nA\n", encoding="utf-8")
    with pytest.raises(InputError, match="is no Excel file"):
        read_rows(tmp_path / "text.xlsx", ("name",), {})
    pd.DataFrame().to_excel(tmp_path / "empty.xlsx", index=False)
    with pytest.raises(InputError, match="is empty"):
        read_rows(tmp_path / "empty.xlsx", ("name",), {})


class Part(StrictModel):
    """A section."""

    name: str
    mass_kg: Annotated[float, Field(gt=0)]


class Whole(StrictModel):
    """A file."""

    format: int
    best: Part
    parts: Annotated[tuple[Part, ...], Field(strict=False)] = ()


GOOD = 'format = 1\n\n[best]\nname = "a"\nmass_kg = 1.5\n\n[[parts]]\nname = "b µ"\nmass_kg = 2.0\n'


def test_toml_reads_back_byte_for_byte(tmp_path):
    whole = Whole(format=1, best=Part(name="a", mass_kg=1.5), parts=(Part(name="b µ", mass_kg=2),))
    dump_toml(tmp_path / "whole.toml", whole)
    assert (tmp_path / "whole.toml").read_text(encoding="utf-8") == GOOD
    assert load_toml(tmp_path / "whole.toml", Whole) == whole


@pytest.mark.parametrize(
    ("old", "new", "says"),
    [
        ("format = 1", "form = 1", "unknown key 'form' in the top level; did you mean 'format'?"),
        ("mass_kg = 2.0", "mas = 2.0", r"unknown key 'mas' in \[\[parts\]\] 1; did you mean 'mass"),
        ("mass_kg = 1.5", "q = 1", r"unknown key 'q' in \[best\]; use name, mass_kg"),
        ("mass_kg = 1.5\n", "", r"key 'mass_kg' in \[best\] is missing: add it"),
        ("mass_kg = 1.5", "mass_kg = -1.5", r"key 'mass_kg' in \[best\] is -1.5: input should be"),
        ("format = 1", "format = '1'", "key 'format' in the top level is \"1\": input should be a"),
        ("format = 1", "format", "is not TOML"),
    ],
)
def test_wrong_keys_are_named(tmp_path, old, new, says):
    (tmp_path / "whole.toml").write_text(GOOD.replace(old, new), encoding="utf-8")
    with pytest.raises(InputError, match=says):
        load_toml(tmp_path / "whole.toml", Whole)


def test_toml_that_cannot_be_read_is_refused(tmp_path):
    with pytest.raises(InputError, match="cannot be read"):
        load_toml(tmp_path / "none.toml", Whole)
    (tmp_path / "bytes.toml").write_bytes(b"\xff\xfe")
    with pytest.raises(InputError, match="is not UTF-8 text"):
        load_toml(tmp_path / "bytes.toml", Whole)
