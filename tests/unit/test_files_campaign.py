"""Campaign folders: reading, tables, new runs, refusals."""

import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from broken_files import (
    all_of,
    edited,
    edits,
    function,
    functions,
    refused,
    without,
    without_sections,
)
from scipy.spatial.transform import Rotation

from deboom.bench.campaign import CampaignPlan, TimeRunPlan
from deboom.bench.campaign_writer import write_campaign
from deboom.bench.operating_run import PlannedRun
from deboom.errors import InputError
from deboom.files.campaign import (
    CampaignEngine,
    CampaignFile,
    add_operating_run,
    read_campaign,
    read_time_run,
)
from deboom.files.schema import append_toml, load_toml
from deboom.measurement.sensors import SensorKind

RUNS = (PlannedRun(5, 220.0, full_load=True), PlannedRun(5, 100.0, full_load=False, rising=False))
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


def test_everything_is_there_in_si(written):
    campaign = read_campaign(written)
    assert campaign.mount_sets == ("M1", "M2")
    assert campaign.powertrain_mounts == ("EnM", "GeM", "TSM")
    assert [mount.pieces for mount in campaign.mounts][-1] == ("left", "right")
    parts = (campaign.runs, campaign.shaker_runs, campaign.static_curves)
    assert [len(part) for part in parts] == [4, 9, 20]
    assert campaign.order == 1.5
    assert campaign.tolerances.sensor_position == 0.002
    assert campaign.tolerances.shaker_angle == pytest.approx(np.deg2rad(0.5))
    assert all(path.is_file() for path in campaign.input_files)
    powertrain = campaign.sensors_of(SensorKind.ACCELEROMETER, campaign.powertrain_mounts)
    assert [sensor.name for sensor in powertrain] == ["A1", "A2", "A3", "A4", "A5", "A6"]
    assert len(campaign.sensors_of(SensorKind.FORCE_CELL, ("TSM",))) == 2
    assert len(campaign.sensors_of(SensorKind.FORCE_CELL, ("Du",), "left")) == 1
    rising, falling = campaign.runs_of("M2")
    assert (rising.rising, rising.full_load, rising.total_ratio) == (True, True, 3.4)
    assert (falling.rising, falling.full_load, falling.torque_limit) == (False, False, 100.0)
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
    edited("channels.csv", "A1 x,acceleration,1,+x", "A1 x,acceleration,1,-x")(copy)
    for path in sorted((copy / "runs").rglob("*.uff")):
        function(path.relative_to(copy), (1, "+x"), response_direction="-x")(copy)
    after = read_campaign(copy)
    for left, other in zip(before.sensors, after.sensors, strict=True):
        assert other.position == pytest.approx(left.position)
        assert other.orientation == pytest.approx(left.orientation)
    for left, other in zip(before.runs, after.runs, strict=True):
        assert other.acceleration.values[:, 0] == pytest.approx(-left.acceleration.values[:, 0])
        assert other.acceleration.values[:, 1:] == pytest.approx(left.acceleration.values[:, 1:])


def test_switched_off_channels_may_be_dead_or_missing(copy):
    edited(TOML, "switched_off = []", 'switched_off = ["A3 y"]')(copy)
    without("channels.csv", "A3 y")(copy)
    campaign = read_campaign(copy, switched_off=["A4 z", "A3 y"])
    assert campaign.switched_off == ("A3 y", "A4 z")
    channels = campaign.runs[0].acceleration.channels
    assert "A3 y" not in channels
    assert "A4 z" in channels


def test_the_temperature_of_the_mounts_is_read_where_it_is_stated(written, copy):
    edited(TOML, "switched_off = []", "switched_off = []\ntest_temperature_c = 31.5")(copy)
    assert read_campaign(copy).test_temperature == 31.5
    assert read_campaign(written).test_temperature is None


def test_a_time_run_is_read_by_name(written):
    run = read_time_run(written, "g5_wot220_time")
    assert run.acceleration.shape == (4096, 24)
    assert run.pulses_per_revolution == 2
    assert run.order == 1.5
    with pytest.raises(InputError, match="there is no time run 'other', use g5_wot220_time"):
        read_time_run(written, "other")


TOML = "campaign.toml"
RUN = "runs/M1/g5_wot220.uff"
SHAKER = 'mount = "GeM"\npiece = ""\naxis = '
A2_Y = (2, "+y")


def pushed(direction):
    return lambda functions: [
        replace(function, reference_direction=direction) for function in functions
    ]


def half_missed(function):
    speed = np.array(function.values)
    speed[-3:] /= 2
    return speed


def gone(*sensors):
    rows = {"sensors.csv": ",", "channels.csv": " "}
    return all_of(*(without(name, *(s + end for s in sensors)) for name, end in rows.items()))


BROKEN = [
    *edits(
        """
campaign.toml | gear = 5 | gear = 9 | run 'g5_wot220' is in gear 9, but total_ratios
campaign.toml | mount = "EnM"\\npiece | mount = "XnM"\\npiece | shaker run at mount 'XnM'
campaign.toml | mount = "EnM"\\naxis | mount = "XnM"\\naxis | static curve of mount 'XnM'
sensors.csv | B&K 4321,EnM | B&K 4321,XnM | sensor 'A1' is at mount 'XnM'
sensors.csv | accelerometer | microphone | sensors.csv line 2: sensor 'A1' is of unknown kind 'micro
sensors.csv | ry [deg] | ry | column 'ry' has no unit: write 'ry [deg]' or [rad]
sensors.csv | ry [deg] | ry [mm] | column 'ry [mm]' is not in rad or a multiple of it
sensors.csv | \\nA2, | \\nA1, | line 3: sensor 'A1' already stands in line 2
channels.csv | 1,+x,m/s^2 | 1,+x,N | acceleration 'A1 x' is in 'N', which is no unit of it
channels.csv | acceleration,1,+x | acceleration,1,+y | acceleration 'A1 x' has direction '+y', which
channels.csv | A1 y,acceleration,1,+y | A1 x,acceleration,1,+x | line 3: acceleration 'A1 x' already
channels.csv | A2 x,acceleration,2 | A2 x,acceleration,1 | line 5: acceleration at node 1 along x al
channels.csv | A1 x, | A99 x, | channel 'A99 x' fits no accelerometer
channels.csv | A1 x, | there is no acceleration channel 'A1 x': add its row, or name it in switched_
channels.csv | engine speed, | 0 channels of quantity 'engine speed', expected one: a run without it
channels.csv | tacho, | 0 channels of quantity 'tacho', expected one: a run without it has no order
campaign.toml | switched_off = [] | test_temperature_c = 304.0 | is it in K or °F?
campaign.toml | switched_off = [] | test_temperature = 31.0 | did you mean 'test_temperature_c'?
campaign.toml | switched_off = [] | switched_off = ["A9 q"] | switched_off names 'A9 q', which is no
campaign.toml | switched_off = [] | switched_off = ["C1 x"] | switched_off names 'C1 x', a force cel
mounts.csv | TSM, | CTSM, | mounts.csv: mount 'CTSM', piece '' is not in
static_curves/M1/TSM_x.csv | -15.0 | a | TSM_x.csv line 2, column 'deflection': 'a' is no finite num
"""
    ),
    (without_sections(TOML, "[[runs]]"), "no [[runs]]: add"),
    (
        all_of(edited(TOML, f'{SHAKER}"x"', f'{SHAKER}"y"'), edited(TOML, SHAKER, SHAKER)),
        "two [[shaker_runs]] are of 'GeM  y 1'",
    ),
    (
        without_sections(TOML, *(f'[[shaker_runs]]\n{SHAKER}"{axis}"' for axis in "xz")),
        "mount 'GeM' has shaker runs along y only: add x, z",
    ),
    (gone("A1", "A3", "A5", "A6"), "2 usable accelerometers on the powertrain, fewer than three"),
    (gone("A7"), "mount 'Du left' carries a body of its own, which has no usable accelerometer"),
    (gone("C8"), "mount 'Du right' has no force cell"),
    (edited("channels.csv", "m/s^2", "g", -1), "is in 'm/s^2', but the channel table says 'g': co"),
    (
        functions(
            RUN, lambda functions_of_file: [f for f in functions_of_file if f.response_node != 3]
        ),
        "run 'g5_wot220' of M1: acceleration 'A3 z' (node 3 +z) is not in it: export it",
    ),
    (function(RUN, (201, "scalar"), values=half_missed), "the tacho reads 1500 rpm at 75 Hz, whic"),
    (function(RUN, A2_Y, values=lambda f: 0 * f.values), "acceleration 'A2 y' is dead, 0 at all l"),
    (function(RUN, A2_Y, values=lambda f: np.abs(f.values)), "acceleration 'A2 y' is real: export"),
    (function(RUN, (201, "+ry"), values=lambda f: f.values + 1j), "is complex: export it as real"),
    (function(RUN, A2_Y, id_lines=("order 3",)), "is of order 3, not of order 1.5"),
    (function(RUN, A2_Y, function_type=4), "acceleration 'A2 y' has UFF function type 4: export i"),
    (
        functions("shaker/GeM_x_1.uff", pushed("+y")),
        "shaker run 'GeM x' 1: its reference is force along '+y', expected one force along 'x'",
    ),
]


@pytest.mark.parametrize(("fault", "sentence"), BROKEN)
def test_what_is_broken_is_named(copy, fault, sentence):
    fault(copy)
    refused(read_campaign, copy, sentence)


def test_a_shaker_that_pulls_turns_the_sign(copy):
    before = read_campaign(copy).shaker_runs[0].response.values
    functions("shaker/EnM_x_1.uff", pushed("-x"))(copy)
    assert read_campaign(copy).shaker_runs[0].response.values == pytest.approx(-before)


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


def test_a_new_run_reads_back_as_it_was_and_comments_stay(folder, run):
    edited(TOML, "[engine]", "# weighed twice\n[engine]")(folder)
    place = add_operating_run(folder, run, ("from elsewhere", "x" * 100))
    assert place == folder / "runs" / "M1" / "again.uff"
    assert "# weighed twice" in (folder / TOML).read_text(encoding="utf-8")
    read_back = read_campaign(folder).runs[-1]
    assert (read_back.name, read_back.gear, read_back.rising) == ("again", 6, True)
    for name in ("engine_torque", "static_force"):
        assert np.array_equal(getattr(read_back, name), getattr(run, name))
    for name in ("acceleration", "cell_force"):
        assert np.array_equal(getattr(read_back, name).values, getattr(run, name).values)


OVER_TIME = edited(TOML, "[[runs]]", "[[time_runs]]\npulses_per_revolution = 2")


def test_channels_in_other_units_and_against_their_axes_read_back_the_same(folder, run):
    table = folder / "channels.csv"
    rows = [
        row.replace("+x", "-x").replace("m/s^2", "g") if ",acceleration," in row else row
        for row in table.read_text(encoding="utf-8").splitlines()
    ]
    table.write_text("\n".join(rows) + "\n", encoding="utf-8")
    # the run that is there is in m/s^2 still: only the new one is asked for
    OVER_TIME(folder)
    add_operating_run(folder, run)
    (read_back,) = read_campaign(folder).runs
    assert read_back.acceleration.values == pytest.approx(run.acceleration.values)


@pytest.mark.parametrize(
    ("change", "spoil", "message"),
    [
        ({"name": "g5_wot220"}, None, "run 'g5_wot220' of mount set M1 is there already"),
        ({"name": "a b"}, None, "'a b' is no name of a run"),
        ({"name": "../out"}, None, "is no name of a run"),
        ({"static_force_names": ("TSM x",), "static_force": np.zeros((11, 1))}, None, "no static"),
        ({}, lambda f: (f / "runs/M1/again.uff").write_bytes(b"x"), "though no run of"),
        ({}, all_of(OVER_TIME, without("channels.csv", "engine speed")), "add its row"),
    ],
)
def test_what_does_not_fit_is_refused_and_nothing_changes(folder, run, change, spoil, message):
    if spoil is not None:
        spoil(folder)
    refused(lambda place: add_operating_run(place, replace(run, **change)), folder, message)


def test_a_dead_channel_is_refused_and_nothing_changes(folder, run):
    values = np.array(run.acceleration.values)
    values[:, 3] = 0
    dead = replace(run, acceleration=replace(run.acceleration, values=values))
    refused(lambda place: add_operating_run(place, dead), folder, "is dead")


def inline_runs(folder, comma=""):
    """Write the run of a campaign as an inline table, and return what stands before and behind."""
    path = folder / TOML
    text = path.read_text(encoding="utf-8")
    start, end = text.index("[[runs]]"), text.index("[[shaker_runs]]")
    inline = ", ".join(line for line in text[start:end].splitlines()[1:] if line)
    array = f"runs = [  # weighed twice\n    {{{inline}}}{comma}  # the first\n]\n"
    head, rest = text[:start].split("[engine]")
    path.write_text(f"{head}{array}[engine]{rest}{text[end:]}", encoding="utf-8")
    return f"{head}runs = [  # weighed twice\n    {{{inline}}}", f"[engine]{rest}{text[end:]}"


@pytest.mark.parametrize("comma", ["", ","])
def test_a_new_run_joins_an_array_of_inline_tables_whose_comments_stay(folder, run, comma):
    before, behind = inline_runs(folder, comma)
    add_operating_run(folder, run)
    text = (folder / TOML).read_text(encoding="utf-8")
    assert text.startswith(before)
    assert text.endswith(behind)
    assert "# the first" in text
    assert [run_read.name for run_read in read_campaign(folder).runs] == ["g5_wot220", "again"]


def test_a_campaign_that_changes_meanwhile_is_refused_and_stays(folder, run):
    tables = folder / TOML

    content = load_toml(tables, CampaignFile)
    tables.write_text(tables.read_text(encoding="utf-8") + "# more\n", encoding="utf-8")
    changed = content.model_copy(update={"name": "other"})
    entry = content.runs[0].model_copy(update={"name": "again"})
    sentence = "leave the file alone meanwhile"
    refused(lambda _: append_toml(tables, changed, "runs", entry), folder, sentence)


# ------------------------------------------------------------------ loads and angles


def engine_of(**keys):
    stated = {"dominant_order": 2.0, "total_ratios": (3.0,), "cylinders": 4} | keys
    return CampaignEngine(**stated)


@pytest.mark.parametrize(
    ("keys", "loads"),
    [
        ({"cylinders": 3, "dominant_order": 1.5}, ("my",)),
        ({"cylinders": 6, "dominant_order": 3.0}, ("my",)),
        ({"cylinders": None}, ("my",)),
        ({"balancer_shafts": True}, ("my",)),
        ({"balancer_shafts": False}, ("fz", "mx", "my")),
        ({}, ("fz", "mx", "my")),
        ({"cylinders": 2, "dominant_order": 1.0}, ("fz", "mx", "my")),
        ({"excited": ("fx", "fz", "mx", "my", "mz")}, ("fx", "fz", "mx", "my", "mz")),
        ({"cylinders": 3, "dominant_order": 1.0, "excited": ("mx", "mz")}, ("mx", "mz")),
    ],
)
def test_loads_follow_from_cylinders_and_balancer_shafts(keys, loads):
    engine = engine_of(**keys)
    assert engine.loads == loads
    assert [*engine.load_faults()] == []


@pytest.mark.parametrize(
    ("keys", "words"),
    [
        ({"cylinders": 3}, "3 cylinders, which fire at order 1.5, and dominant_order 2"),
        ({"excited": ("my", "my")}, "two [engine] excited names 'my'"),
        ({"excited": ("fx", "fy", "fz", "mx", "my", "mz")}, "names all six loads"),
        ({"excited": ("my",), "balancer_shafts": True}, "both excited and balancer_shafts"),
    ],
)
def test_loads_that_contradict_themselves(keys, words):
    (fault,) = engine_of(**keys).load_faults()
    assert words in fault


def test_excited_loads_reach_the_campaign(copy):
    path = copy / "campaign.toml"
    path.write_text(path.read_text().replace("[engine]", '[engine]\nexcited = ["fz", "my"]'))
    assert read_campaign(copy).excited == ("fz", "my")
    path.write_text(path.read_text().replace('"fz", "my"', '"fq"'))
    with pytest.raises(InputError, match="excited"):
        read_campaign(copy)


def test_another_order_of_rotations_by_name(copy):
    sheet = copy / "sensors.csv"
    table = pd.read_csv(sheet)
    before = read_campaign(copy).sensors[0]
    assert before.rotation_order == "RzRyRx"
    table["rotation_order"] = "RxRyRz"
    table.to_csv(sheet, index=False)
    after = read_campaign(copy).sensors[0]
    angles = np.deg2rad(table.loc[0, ["rx [deg]", "ry [deg]", "rz [deg]"]].to_numpy(float))
    assert after.rotation_order == "RxRyRz"
    # about axes that turn along: x, then the new y, then the new z
    expected = Rotation.from_euler("XYZ", angles).as_matrix()
    assert after.orientation == pytest.approx(expected, abs=1e-12)
    assert before.orientation == pytest.approx(Rotation.from_euler("xyz", angles).as_matrix())
    table["rotation_order"] = "yaw"
    table.to_csv(sheet, index=False)
    with pytest.raises(InputError, match=r"'A1' has the rotation_order 'yaw', use one of Rz"):
        read_campaign(copy)
