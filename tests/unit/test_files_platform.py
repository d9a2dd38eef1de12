"""Platform folders and their file: reading and refusals."""

import re
import shutil
from dataclasses import replace
from functools import partial

import numpy as np
import pytest
from broken_files import all_of, content, edited, edits, function, functions, refused, without

from deboom.errors import InputError
from deboom.files.platform import PlatformFile, read_platform
from deboom.files.rows import QUANTITY_UNIT, ChannelRow, MountRow
from deboom.files.schema import Several, StrictModel, dump_toml, load_toml
from deboom.files.tables import write_table
from deboom.files.uff import UffFunction, write_uff
from deboom.files.units import parse_unit

LINES = 20.0 + 0.5 * np.arange(5)
NODE = {"TSM": 11, "Du left": 21, "Du right": 22, "Du": 31}
CHANNELS = ("TSM x", "TSM y", "TSM z", "Du left x", "Du right x")
PATHS = ("TSM x", "TSM z", "Du x")


def noise(*key):
    """Values that tell each function of the platform from all others."""
    phase = np.array([sum(map(ord, "".join(key)))]) * 0.01
    return (1 + LINES / 100) * np.exp(1j * (phase + LINES))


def split(channel):
    *owner, axis = channel.split()
    return " ".join(owner), axis


def transfer_functions(vehicle):
    functions = []
    for path in PATHS:
        mount, axis = split(path)
        dofs = (901, "scalar", NODE[mount], f"+{axis}")
        units = ("pressure", "Pa", "force", "N")
        function = UffFunction(LINES, noise(vehicle, path), 4, *dofs, *units)
        functions.append(replace(function, response_name="driver ear"))
    return functions


def operating_spectra(case):
    functions = []
    for quantity, unit in (("force", "N"), ("displacement", "m")):
        for channel in CHANNELS:
            owner, axis = split(channel)
            of = (0, NODE[owner], f"+{axis}", 0, "scalar", quantity, unit)
            function = UffFunction(LINES, noise(case, channel, quantity), *of)
            functions.append(replace(function, id_lines=("order 1.5 at the virtual point",)))
    return functions


def channel_rows():
    rows = []
    for quantity, unit in QUANTITY_UNIT.items():
        for channel in PATHS if unit == "Pa/N" else CHANNELS:
            owner, axis = split(channel)
            mount, _, piece = owner.partition(" ")
            place = (mount, piece, axis, NODE[owner], f"+{axis}", parse_unit(unit))
            rows.append(ChannelRow(channel, quantity, *place))
    return rows


def write_tiny_platform(folder):
    (folder / "ntf").mkdir(parents=True)
    file = PlatformFile.model_validate(
        {
            "format": 1,
            "name": "tiny",
            "title": "Tiny platform",
            "description": "Two mounts, three vehicles, two runs.",
            "mount_table": "mounts.csv",
            "channel_table": "channels.csv",
            "default_load_case": "g5",
            "engine": {"cylinders": 3, "dominant_order": 1.5, "total_ratios": [16.0, 9.0, 3.5]},
            "powertrain": {
                "mass_kg": 193.5,
                "mass_tolerance_kg": 1.0,
                "inertia_kg_m2": [[11.0, 0.0, 0.0], [0.0, 6.8, 0.0], [0.0, 0.0, 9.6]],
                "inertia_tolerance": 0.02,
                "centre_of_gravity_tolerance_m": 0.002,
            },
            "mounts": [
                {"name": "TSM", "description": "strut", "transfer_axes": ["x", "z"]},
                {
                    "name": "Du",
                    "description": "wishbone",
                    "pieces": ["left", "right"],
                    "transfer_axes": ["x"],
                    "body_mass_kg": 40.2,
                    "body_mass_tolerance_kg": 1.0,
                },
            ],
            "vehicles": [
                {"name": v, "group": g, "noise_transfer": f"ntf/{v}.uff", "ear_node": 901}
                for v, g in (("A-1", "A"), ("A-2", "A"), ("B-1", "B"))
            ],
            "load_cases": [
                {
                    "name": name,
                    "title": f"gear {gear}",
                    "gear": gear,
                    "torque_limit_nm": 220.0,
                    "operating": f"{name}.uff",
                }
                for name, gear in (("g5", 3), ("g2", 2))
            ],
        }
    )
    dump_toml(folder / "platform.toml", file)
    places = (("TSM", "", (0.2, -0.06, -0.27)),)
    places += (("Du", "left", (-0.5, -0.3, -0.1)), ("Du", "right", (-0.5, 0.3, -0.1)))
    write_table(folder / "mounts.csv", MountRow, [MountRow(*place) for place in places])
    write_table(folder / "channels.csv", ChannelRow, channel_rows())
    for vehicle in file.vehicles:
        write_uff(folder / vehicle.noise_transfer, transfer_functions(vehicle.name))
    for case in file.load_cases:
        write_uff(folder / case.operating, operating_spectra(case.name))
    return folder


@pytest.fixture(scope="module")
def written(tmp_path_factory):
    return write_tiny_platform(tmp_path_factory.mktemp("platform") / "tiny")


@pytest.fixture
def folder(written, tmp_path):
    return shutil.copytree(written, tmp_path / "tiny")


# ---- what is read


def test_a_platform_is_read_in_the_order_of_its_mounts(folder):
    platform = read_platform(folder)
    assert (platform.name, platform.title, platform.folder) == ("tiny", "Tiny platform", folder)
    tsm, du = platform.mounts
    assert tsm.positions == ((0.2, -0.06, -0.27),)
    assert (du.pieces, du.positions[1]) == (("left", "right"), (-0.5, 0.3, -0.1))
    assert (tsm.body_mass, du.body_mass, du.body_mass_tolerance) == (None, 40.2, 1.0)
    sheet = platform.powertrain
    assert (sheet.mass, sheet.mass_tolerance) == (193.5, 1.0)
    assert (sheet.inertia_tolerance, sheet.centre_tolerance) == (0.02, 0.002)
    np.testing.assert_array_equal(sheet.inertia, np.diag([11.0, 6.8, 9.6]))
    np.testing.assert_array_equal(sheet.centre, np.zeros(3))
    for vehicle in platform.fleet.vehicles:
        frf = vehicle.noise_transfer
        assert (frf.outputs, frf.inputs, frf.unit) == (("driver ear",), PATHS, "Pa/N")
        for i, path in enumerate(PATHS):
            np.testing.assert_allclose(frf.values[:, 0, i], noise(vehicle.name, path), rtol=1e-11)
    for case in platform.load_cases:
        for spectrum, quantity in ((case.displacement, "displacement"), (case.force, "force")):
            assert spectrum.channels == CHANNELS
            np.testing.assert_array_equal(spectrum.frequency, LINES)
            for i, channel in enumerate(CHANNELS):
                wanted = noise(case.name, channel, quantity)
                np.testing.assert_allclose(spectrum.values[:, i], wanted, rtol=1e-11)
    g5 = platform.load_case("g5")
    assert (g5.gear, g5.total_ratio, g5.torque_limit, g5.order) == (3, 3.5, 220.0, 1.5)
    assert platform.default_load_case == "g5"
    files = {path for path in folder.rglob("*") if path.is_file()}
    assert set(platform.input_files) == files
    assert len(platform.input_files) == len(files) == 8


def test_load_cases_and_groups_are_chosen_by_name(folder):
    platform = read_platform(folder)
    assert platform.load_case("g2").gear == 2
    assert [vehicle.name for vehicle in platform.fleet.group("A").vehicles] == ["A-1", "A-2"]
    with pytest.raises(InputError, match=r"platform\.toml: there is no load case 'g7': use g5, g2"):
        platform.load_case("g7")
    with pytest.raises(InputError, match="no vehicle of group 'C' in the fleet"):
        platform.fleet.group("C")


def test_the_order_in_a_file_and_further_functions_change_nothing(folder):
    before = read_platform(folder).load_case("g5").force
    further = replace(operating_spectra("g5")[0], response_node=77, abscissa=LINES + 1)
    write_uff(folder / "g5.uff", [further, *operating_spectra("g5")[::-1]])
    after = read_platform(folder).load_case("g5").force
    np.testing.assert_array_equal(before.values, after.values)
    np.testing.assert_array_equal(before.frequency, after.frequency)


def test_a_channel_measured_against_its_axis_changes_sign(folder):
    before = read_platform(folder)
    edited("channels.csv", "TSM z,force,TSM,,z,11,+z", "TSM z,force,TSM,,z,11,-z")(folder)
    edited("channels.csv", "function,TSM,,z,11,+z", "function,TSM,,z,11,-z")(folder)

    def turned(end, ordinate, functions):
        return [
            replace(f, **{end: "-z"}) if (getattr(f, end), f.ordinate) == ("+z", ordinate) else f
            for f in functions
        ]

    for case in ("g5", "g2"):
        functions(f"{case}.uff", partial(turned, "response_direction", "force"))(folder)
    for vehicle in ("A-1", "A-2", "B-1"):
        change = partial(turned, "reference_direction", "pressure")
        functions(f"ntf/{vehicle}.uff", change)(folder)
    after = read_platform(folder)
    signs = np.array([1, 1, -1, 1, 1])
    wanted = before.load_case("g5").force.values * signs
    np.testing.assert_array_equal(after.load_case("g5").force.values, wanted)
    wanted = before.fleet.vehicles[0].noise_transfer.values * np.array([1, -1, 1])
    np.testing.assert_array_equal(after.fleet.vehicles[0].noise_transfer.values, wanted)


def test_a_file_in_mm_is_converted_when_file_and_table_both_say_so(folder):
    before = read_platform(folder).load_case("g5")
    text = (folder / "channels.csv").read_text()
    (folder / "channels.csv").write_text(re.sub(r"(displacement,.*),m\n", r"\1,mm\n", text))
    for case in ("g5", "g2"):
        without_units_set(f"{case}.uff")(folder)
        edited(f"{case}.uff", "displacement         m ", "displacement         mm", -1)(folder)
    after = read_platform(folder).load_case("g5")
    np.testing.assert_allclose(after.displacement.values, 1e-3 * before.displacement.values)
    np.testing.assert_array_equal(after.force.values, before.force.values)


def test_files_in_different_units_are_read_where_the_table_states_none(folder):
    before = read_platform(folder)
    without_units_set("g2.uff")(folder)
    edited("g2.uff", "displacement         m ", "displacement         mm", -1)(folder)
    with pytest.raises(InputError, match="or leave the table's empty where files differ"):
        read_platform(folder)
    text = (folder / "channels.csv").read_text()
    (folder / "channels.csv").write_text(re.sub(r"(displacement,.*),m\n", r"\1,\n", text))
    after = read_platform(folder)
    for case, factor in (("g5", 1.0), ("g2", 1e-3)):
        expected = factor * before.load_case(case).displacement.values
        np.testing.assert_allclose(after.load_case(case).displacement.values, expected)


# ---- what is refused

NTF, G5 = "ntf/B-1.uff", "g5.uff"
CSV = "channels.csv"
STATED = "TSM x,displacement,TSM,,x,11,+x,"


def every(**changes):
    return lambda functions: [
        replace(f, **{k: v(f) if callable(v) else v for k, v in changes.items()}) for f in functions
    ]


def without_units_set(name):
    def fault(folder):
        data = (folder / name).read_bytes()
        (folder / name).write_bytes(data[data.index(b"    -1\n    58") :])

    return fault


BROKEN = [
    *edits(
        """
platform.toml | ear_node = 901 | ear_node = 902 | vehicle A-1 ... (node 902 scalar, reference node 1
channels.csv | TSM z,force | channels.csv: there is no force channel 'TSM z': add its row
channels.csv | Du x,noise | there is no noise transfer function channel 'Du x'
channels.csv | Du x, | CTSM x,force,CTSM,,x,41,+x,N\\nDu x, | force channel 'CTSM x' fits no mount
"""
    ),
    (function(NTF, 0, response_name="MIC 2"), "vehicle B-1: noise transfer functions of different"),
    (functions(G5, every(abscissa_quantity="time")), "g5.uff: load case g5: the abscissa of"),
    (edited(CSV, f"{STATED}m", f"{STATED}mm"), "displacement 'TSM x' is in 'm', but the channel t"),
    (
        all_of(
            without_units_set(G5),
            edited(G5, "displacement         m   ", "displacement         NONE"),
        ),
        "g5.uff: load case g5: displacement 'TSM x' has no unit ... data set 164 ... says 'm'",
    ),
    (functions(NTF, every(denominator="none", denominator_unit="")), "'Pa': export it in Pa/N"),
    (functions(G5, every(values=lambda f: np.abs(f.values))), "load case g5: force 'TSM x' is rea"),
    (functions(G5, every(function_type=2)), "load case g5 ... UFF function type 2: export it as 0"),
    (functions(G5, every(id_lines=("order 2.0",))), "load case g5 ... is of order 2.0, not of ord"),
    (without(CSV, "Du left x", "Du right x"), "mount 'Du' has no channel: add 'Du left x'"),
    (
        edited(CSV, "Du x,", "Du y,noise transfer function,Du,,y,31,+y,Pa/N\nDu x,"),
        ("channel 'Du y' fits no mount, piece and transfer axis of platform.toml: correct one"),
    ),
    (
        all_of(
            edited("platform.toml", '["x", "z"]', "[]"),
            edited("platform.toml", '= ["x"]', "= []"),
            without(CSV, *(f"{path},noise" for path in PATHS)),
        ),
        "no mount of platform.toml has a transfer axis: name one",
    ),
]


@pytest.mark.parametrize(("fault", "words"), BROKEN)
def test_what_is_broken_is_named(folder, fault, words):
    fault(folder)
    refused(read_platform, folder, words)


def test_many_faults_are_ten_and_a_number(folder):
    edited(CSV, "TSM", "ABC", -1)(folder)
    assert re.search(r"\nand \d+ more$", refused(read_platform, folder, "channel 'ABC x'"))


# ---- receivers

SEAT = (902, "+z", "acceleration", "m/s^2")


def with_receivers(folder, entries, vehicle="A-1", file="seat.uff", at=SEAT):
    """State receivers of a vehicle, and write functions at a node and direction to another file."""
    place = f'ntf/{vehicle}.uff"\near_node = 901\n'
    tables = "".join(f"\n[[vehicles.receivers]]\n{entry}\n" for entry in entries)
    edited("platform.toml", place, f'ntf/{vehicle}.uff"\n{tables}')(folder)
    node, direction, ordinate, unit = at
    functions = [
        replace(
            function,
            response_node=node,
            response_direction=direction,
            ordinate=ordinate,
            ordinate_unit=unit,
            values=0.5 * function.values,
            response_name="",
        )
        for function in transfer_functions(vehicle)
    ]
    write_uff(folder / file, functions)


EAR_KEYS = 'name = "driver ear"\nkind = "sound"\nnode = 901\nweight = 2.0\ntarget_db = 61.0'
SEAT_KEYS = 'name = "seat rail z"\nkind = "vibration"\nnode = 902\ndirection = "+z"\n'
SEAT_KEYS += 'functions = "seat.uff"\nweighting = "Wk"\ntarget_db = 80.0'


def test_receivers_are_read_with_their_functions(folder):
    before = read_platform(folder).fleet.vehicles[0]
    with_receivers(folder, (EAR_KEYS, SEAT_KEYS))
    platform = read_platform(folder)
    vehicle = platform.fleet.vehicles[0]
    transfer = before.noise_transfer.values
    np.testing.assert_array_equal(vehicle.noise_transfer.values, transfer)
    assert (vehicle.ear.weight, vehicle.ear.target) == (2.0, 61.0)
    ((seat, functions),) = vehicle.receivers.items()
    wanted = ("seat rail z", "acceleration", "Wk", 80.0)
    assert (seat.name, seat.quantity, seat.weighting, seat.target) == wanted
    assert (functions.unit, functions.inputs) == ("m/s^2/N", PATHS)
    np.testing.assert_allclose(functions.values, 0.5 * transfer, rtol=1e-11)
    assert platform.fleet.response_names == ("A-1", "A-1, seat rail z", "A-2", "B-1")
    assert platform.fleet.vehicle_of == (0, 0, 1, 2)
    assert folder / "seat.uff" in platform.input_files


def test_receivers_of_a_table_have_channels(folder):
    header, rows = ["frequency [Hz]"], [LINES]
    for channel, unit in (("ear", "Pa/N"), ("wheel y", "mm/s/N")):
        for path in PATHS:
            values = noise(channel, path)
            header += [f"{channel} {path} {part} [{unit}]" for part in ("real", "imag")]
            rows += [values.real, values.imag]
    np.savetxt(
        folder / "ntf/A-1.csv",
        np.array(rows).T,
        delimiter=",",
        header=",".join(header),
        comments="",
        fmt="%.12g",
    )
    wheel = 'name = "wheel y"\nkind = "vibration"\nchannel = "wheel y"'
    with_receivers(folder, ('name = "ear"\nkind = "sound"\nchannel = "ear"', wheel))
    edited("platform.toml", "ntf/A-1.uff", "ntf/A-1.csv")(folder)
    vehicle = read_platform(folder).fleet.vehicles[0]
    ((receiver, functions),) = vehicle.receivers.items()
    assert (receiver.quantity, receiver.level_unit) == ("velocity", "dB re 1 nm/s")
    transfer = vehicle.noise_transfer.values
    np.testing.assert_allclose(transfer[:, 0, 1], noise("ear", PATHS[1]), rtol=1e-9)
    felt = functions.values[:, 0, 2]
    np.testing.assert_allclose(felt, 1e-3 * noise("wheel y", PATHS[2]), rtol=1e-9)


WRONG_RECEIVERS = [
    ((SEAT_KEYS,), "the first receiver is the ear that has the vehicle's name: put a sound first"),
    ((EAR_KEYS, SEAT_KEYS, SEAT_KEYS), "two receivers of vehicle A-1 are named 'seat rail z'"),
    ((EAR_KEYS, SEAT_KEYS.replace("vibration", "sound")), "a sound is A-weighted and has no direc"),
    ((EAR_KEYS, SEAT_KEYS + "\nweight = 1.0"), "a vibration is in no sum of levels of sound: leav"),
    (
        (EAR_KEYS, SEAT_KEYS.replace("node = 902\n", "")),
        "state where it is: the node of a UFF",
    ),
    (
        (EAR_KEYS, SEAT_KEYS.replace("node = 902", 'channel = "seat"')),
        "a direction goes with a node",
    ),
    ((EAR_KEYS, SEAT_KEYS.replace('"+z"', '"up"')), "a direction is one such as '+z'"),
    ((EAR_KEYS, SEAT_KEYS.replace("rail z", "rail, z")), "in a few words without commas"),
    ((EAR_KEYS, SEAT_KEYS.replace("Wk", "Wb")), """is "Wb": input should be 'Wk', 'Wd' or 'Wh'"""),
    ((EAR_KEYS, SEAT_KEYS.replace("902", "903")), "seat.uff: vehicle A-1: receiver 'seat rail z'"),
    ((EAR_KEYS, SEAT_KEYS.replace('direction = "+z"\n', "")), "state the direction of its acceler"),
]


@pytest.mark.parametrize(("entries", "words"), WRONG_RECEIVERS)
def test_receivers_that_cannot_be_are_refused(folder, entries, words):
    with_receivers(folder, entries)
    refused(read_platform, folder, words)


@pytest.mark.parametrize(
    ("at", "words"),
    [
        ((902, "+z", "pressure", "Pa"), 'kind = "vibration", and its functions are in Pa/N: corr'),
        ((902, "+z", "velocity", "m/s"), "is a velocity, and Wk weights accelerations: give func"),
    ],
)
def test_functions_that_do_not_fit_their_receiver_are_refused(folder, at, words):
    with_receivers(folder, (EAR_KEYS, SEAT_KEYS), at=at)
    refused(read_platform, folder, words)


def test_an_ear_node_beside_receivers_is_refused(folder):
    place = "ear_node = 901\n"
    edited("platform.toml", place, f"{place}\n[[vehicles.receivers]]\n{EAR_KEYS}\n")(folder)
    refused(read_platform, folder, "ear_node and receivers say the same: keep the receivers")


# ---- engine torque


def with_torque(text):
    key = 'operating = "g5.uff"'
    return all_of(
        edited("platform.toml", key, f'{key}\ntorque_table = "g5.csv"'), content("g5.csv", text)
    )


def torque_text(lines=LINES, header="frequency [Hz],engine torque [N m]"):
    return "\n".join([header, *(f"{line},{100 + line}" for line in lines)]) + "\n"


def test_the_engine_torque_is_read_where_there_is_a_table(folder):
    with_torque(torque_text())(folder)
    platform = read_platform(folder)
    np.testing.assert_array_equal(platform.load_case("g5").engine_torque, 100 + LINES)
    assert platform.load_case("g2").engine_torque is None
    assert folder / "g5.csv" in platform.input_files


def test_the_line_at_0_hz_of_a_torque_table_is_left_out(folder):
    with_torque(torque_text(np.r_[0.0, LINES]))(folder)
    with pytest.warns(UserWarning, match="0 Hz"):
        platform = read_platform(folder)
    np.testing.assert_array_equal(platform.load_case("g5").engine_torque, 100 + LINES)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (torque_text(LINES[:-1]), "g5.csv: the lines ... differ: 5 and 4 lines; export the torque"),
        (torque_text(LINES[:1]), "5 and 1 lines"),
        (torque_text(LINES + 0.1), "line 1 is 20 Hz and 20.1 Hz"),
        (torque_text(header="frequency [Hz],engine torque"), "engine torque' has no unit"),
        (torque_text(header="frequency [Hz],engine torque [N]"), "is not in N m"),
        (torque_text().replace("120.5", "high"), "line 3, column 'engine torque': 'high' is no"),
        (None, "g5.csv cannot be read"),
    ],
)
def test_a_torque_table_that_does_not_fit_is_refused(folder, text, words):
    with_torque(text)(folder)
    refused(read_platform, folder, words)


@pytest.fixture
def path(folder):
    return folder / "platform.toml"


def test_what_would_be_refused_is_not_dumped(path):
    files = sorted(path.parent.iterdir())
    platform = load_toml(path, PlatformFile)
    cases = (platform.load_cases[1],)
    with pytest.raises(InputError, match="default_load_case 'g5' is not among the load cases g2"):
        dump_toml(path.parent / "a.toml", platform.model_copy(update={"load_cases": cases}))
    # pydantic checks nothing in model_copy
    with pytest.raises(InputError, match="key 'format' in the top level is 2"):
        dump_toml(path.parent / "a.toml", platform.model_copy(update={"format": 2}))
    with pytest.raises(InputError, match=r"a\.toml cannot be written \(No such file"):
        dump_toml(path.parent / "absent" / "a.toml", platform)
    assert sorted(path.parent.iterdir()) == files


@pytest.mark.parametrize(
    ("fault", "sentence"),
    edits(
        """
gear = 2 | gear = "x"\\ngaer = 1 | key 'gear' in [[load_cases]] 2 is "x"
mass_kg = 193.5\\nmass_tolerance_kg = 1.0 | mass_kg = 0 | 'mass_tolerance_kg' in [powe
mass_kg | mass | unknown key 'mass' in [powertrain]; did you mean 'mass_kg'?
[engine] | [motor] | unknown key 'motor' in the top level; use format, name,
gear = 2\\n |  | key 'gear' in [[load_cases]] 2 is missing: add it
gear = 2 | gear = "6" | 'gear' in [[load_cases]] 2 is "6": input should be a valid int
gear = 2 | gear = true | 'gear' in [[load_cases]] 2 is true: input should be a valid
[11.0, 0.0 | [true, 0.0 | key 'inertia_kg_m2[0][0]' in [powertrain] is true
format = 1 | format = 2 | key 'format' in the top level is 2: input should be 1
mass_kg = 193.5 | mass_kg = nan | 'mass_kg' in [powertrain] is NaN: input should be
0.0, 9.6] | 0.5, 9.6] | an inertia tensor is symmetric and positive
[11.0, 0.0 | [-11.0, 0.0 | an inertia tensor is symmetric and positive
["x", "z"] | ["x", "w"] | key 'transfer_axes[1]' in [[mounts]] 1 is "w": input
["x", "z"] | ["x", "x"] | two transfer_axes of mount TSM are named 'x'
name = "Du" | name = "TSM" | two [[mounts]] are named 'TSM': keep or rename one
name = "g2" | name = "g5" | two [[load_cases]] are named 'g5'
["left", "right"] | ["left", "left"] | two pieces of mount Du are named 'left'
["left", "right"] | ["left"] | key 'pieces' in [[mounts]] 2
name = "Du" | name = "D u" | at least one character, no blanks
"g2.uff" | "../g2.uff" | 'operating' in [[load_cases]] 2 is "../g2.uff": a file is
"g2.uff" | "/data/g2.uff" | relative to the platform folder
body_mass_tolerance_kg = 1.0\\n |  | 'body_mass_tolerance_kg' in [[mounts]] 2 is null
body_mass_tolerance_kg = 1.0 | body_mass_tolerance_kg = 50.0 | a tolerance below it
body_mass_kg = 40.2\\n |  | is 1.0: a tolerance needs the key 'body_mass_kg'
"g2.uff" | 'C:\\g2.uff' | relative to the platform folder
""",
        "platform.toml",
    ),
)
def test_a_wrong_key_is_named_with_its_place(path, fault, sentence):
    fault(path.parent)
    told = refused(lambda _: load_toml(path, PlatformFile), path.parent, sentence)
    assert all(line.startswith((str(path), "and ")) for line in told.splitlines())


BRACKETS = {
    "{engine = [1e3, 1e3, 0.3]}": "a bracket has 50 to 1e+07 N/mm along each axis",
    "{engine = [1e3, 1e3]}": "engine has three numbers",
    "{engine = [1e3, 1e3, true]}": "engine has three numbers",
    "{engin = [1e3, 1e3, 1e3]}": "is of the brackets engine and body",
    "{}": "is of the brackets engine and body",
    "900.0": "is of the brackets engine and body",
    '{body = "../b.csv"}': "name the table of body relative to the platform folder",
}


@pytest.mark.parametrize("stated", BRACKETS)
def test_a_wrong_bracket_is_one_sentence(path, stated):
    name = 'name = "Du"\n'
    text = path.read_text().replace(name, f"{name}bracket_stiffness_n_per_mm = {stated}\n")
    path.write_text(text)
    told = refused(lambda _: load_toml(path, PlatformFile), path.parent, BRACKETS[stated])
    assert len(told.splitlines()) == 1


def test_a_list_without_load_cases_is_refused(path):
    before, _, _ = path.read_text().partition("[[load_cases]]")
    path.write_text(f"load_cases = []\n{before}")
    refused(lambda _: load_toml(path, PlatformFile), path.parent, "load_cases")


def test_a_key_that_is_spelt_otherwise_is_not_missing_as_well(path):
    edited(path.name, "gear = 2", "gaer = 2")(path.parent)
    told = refused(lambda _: load_toml(path, PlatformFile), path.parent, "did you mean 'gear'?")
    assert len(told.splitlines()) == 1


class Part(StrictModel):
    """A section."""

    name: str
    mass_kg: float


class Whole(StrictModel):
    """A file."""

    format: int
    best: Part
    parts: Several[Part] = ()


@pytest.mark.parametrize("title", ["a\x7fb", 'a "b" \\c', "line\nline", "µ 測 # no comment", ""])
def test_any_text_is_written_as_toml_that_reads_back(path, title):
    platform = load_toml(path, PlatformFile).model_copy(update={"title": title})
    dump_toml(path.parent / "a.toml", platform)
    assert load_toml(path.parent / "a.toml", PlatformFile) == platform


def test_toml_reads_back_byte_for_byte(tmp_path):
    whole = Whole(
        format=1, best=Part(name="a", mass_kg=1.5), parts=(Part(name='"b" µ', mass_kg=2),)
    )
    dump_toml(tmp_path / "whole.toml", whole)
    assert (tmp_path / "whole.toml").read_text(encoding="utf-8") == (
        'format = 1\n\n[best]\nname = "a"\nmass_kg = 1.5\n\n'
        '[[parts]]\nname = "\\"b\\" µ"\nmass_kg = 2.0\n'
    )
    assert load_toml(tmp_path / "whole.toml", Whole) == whole
