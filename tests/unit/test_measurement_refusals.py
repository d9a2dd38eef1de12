"""Measurements that do not fit together, and what makes no result, are refused in a sentence."""

import math
from dataclasses import astuple, replace

import numpy as np
import pytest

from deboom.errors import InputError
from deboom.measurement import compressor_test, quality
from deboom.measurement.campaign import OperatingRun, ShakerRun, StaticCurve
from deboom.measurement.channels import Frf, LoadCase, Spectrum
from deboom.measurement.culprit import Fault, culprit_of_responses, find_culprit
from deboom.measurement.force_transfer import force_transfer_matrix
from deboom.measurement.noise_transfer import (
    noise_transfer_at_points,
    noise_transfer_of_paths,
    reciprocal_noise_transfer,
)
from deboom.measurement.path_forces import (
    forces_by_inversion,
    forces_by_mount_stiffness,
    validate_on_board,
)
from deboom.measurement.sensor_classes import CLASS_DEFAULTS
from deboom.measurement.sensors import Impact, PlacementTolerances, Sensor, SensorKind, Tolerances
from deboom.measurement.uncertainty import method_difference, pivotal_interval
from deboom.measurement.virtual_point import (
    conditioning,
    impact_geometry,
    sensor_geometry,
    virtual_point,
    virtual_point_frf,
)
from deboom.physics.frf import FrfForm
from deboom.vehicles.fleet import Fleet, Vehicle
from deboom.vehicles.platform_uncertainty import transfer_sources
from deboom.vehicles.uncertain_data import UncertainData, run_noise
from samples.hammer_test import EXACT, InjectedFault, draw_hammer_test, measure

LINES = np.array([20.0, 30.0, 40.0])
NOT_FINITE = np.array([0.0, np.nan, 1.0])


def frf(inputs=("M x", "M z"), outputs=("ear",), unit="Pa/N", lines=LINES, value=1.0 + 0j):
    values = np.full((len(lines), len(outputs), len(inputs)), value)
    return Frf(np.asarray(lines), values, tuple(outputs), tuple(inputs), unit)


def spectrum(unit, channels=("M x", "M z"), lines=LINES, value=1.0 + 0j):
    values = np.full((len(lines), len(channels)), value)
    return Spectrum(np.asarray(lines), values, tuple(channels), unit)


# runs and load cases


def run(torque):
    return OperatingRun(
        name="g5",
        mount_set="M1",
        gear=5,
        total_ratio=3.4,
        full_load=True,
        torque_limit=220.0,
        rising=True,
        order=1.5,
        engine_torque=torque,
        acceleration=spectrum("m/s^2", ("A1 x",)),
        cell_force=spectrum("N", ("C1 x",)),
        static_force=np.zeros((3, 2)),
        static_force_names=("EnM x", "EnM y"),
    )


def case(name="g5", lines=LINES, **changes):
    motion, force = spectrum("m", lines=lines), spectrum("N", lines=lines)
    fields = {"order": 1.5, "displacement": motion, "force": force}
    return LoadCase(name, "", 5, 3.4, 220.0, **fields | changes)


def curve(deflection, force):
    return StaticCurve("TSM", "x", "M1", np.array(deflection), np.array(force), 0.03)


# sensors, impacts and their virtual points

PLACES = {"A1": (0.1, 0, 0), "A2": (0, 0.1, 0), "A3": (0, 0, 0.1), "A4": (-0.1, 0.02, 0.03)}


def sensor(name, place=None, kind=SensorKind.ACCELEROMETER):
    place = np.array(PLACES[name] if place is None else place, dtype=float)
    return Sensor(name, kind, "356A", "Du", "left", place, np.eye(3))


SENSORS = [sensor(name) for name in PLACES]
CELL = sensor("C1", (0, 0, 0), SensorKind.FORCE_CELL)
ON_A_LINE = [sensor(f"A{k}", (0.1 * k, 0.2, 0.0)) for k in range(4)]
IMPACTS = [
    Impact(f"I{k} {axis}", np.array(place), np.eye(3)["xyz".index(axis)])
    for k, place in enumerate(PLACES.values())
    for axis in "xyz"
]
POINT = virtual_point(sensor_geometry(SENSORS))
STRUCK, TWO_PLACES = impact_geometry(IMPACTS), impact_geometry(IMPACTS[:6])
SILENT = spectrum("m/s^2", POINT.geometry.channels, value=0.0)
ONE_SILENT_LINE = replace(SILENT, values=SILENT.values + (LINES != 30.0)[:, np.newaxis])


def shaken(*runs, cells=(CELL,)):
    """Transfer of the cells out of shaker runs, each an axis and what is not as it should be."""
    shaker_runs = []
    for axis, changes in ((name[0], changes) for name, changes in runs):
        column = changes.get("column", np.eye(3)["xyz".index(axis)])
        piece, lines = changes.get("piece", "left"), changes.get("lines", LINES)
        values = np.tile(np.asarray(column)[:, np.newaxis], (3, 1, 1)).astype(complex)
        channels = changes.get("channels", CELL.channels)
        response = Frf(lines, values, channels, (f"Du {piece} {axis}",), "N/N")
        shaker_runs.append(ShakerRun("Du", piece, axis, 1, response))
    return force_transfer_matrix(shaker_runs, cells, "Du", "left")


X, Y, Z = (("x", {}), ("y", {}), ("z", {}))

CHANNELS = [channel for each in SENSORS for channel in each.channels]
COHERENCE = np.full((3, 12, 12), 0.9)
TEST = compressor_test.InertanceTest(
    "test",
    tuple(SENSORS),
    tuple(IMPACTS),
    frf([impact.name for impact in IMPACTS], CHANNELS, compressor_test.ACCELERATION_PER_FORCE),
    COHERENCE,
    5,
    PlacementTolerances(),
)
MOUNT = compressor_test.CompressorMount("mount 1", np.zeros(3), np.zeros(3), np.ones(3))


def square(n_output, n_input, *, zero=False):
    whole = frf(range(n_input), [f"o{k}" for k in range(n_output)], "m/s^2/N")
    return replace(whole, values=whole.values * (0 if zero else 1))


# forces of the paths

RNG = np.random.default_rng(1)
PATHS, INDICATORS, KEPT_OUT = ("TSM x", "EnM x"), ("strut", "rail", "dash"), ("floor", "roof")
DRAWN = RNG.normal(size=(2, 3, 5, 2))
ALL = Frf(LINES, DRAWN[0] + 1j * DRAWN[1], INDICATORS + KEPT_OUT, PATHS, "m/s²/N")
RESPONSE = ALL @ Spectrum(LINES, [[1.0, 2.0j]] * 3, PATHS, "N")
ACCELERANCE, VALIDATION = ALL.select(outputs=INDICATORS), ALL.select(outputs=KEPT_OUT)
FORCES = forces_by_inversion(ACCELERANCE, RESPONSE)
TWICE = Frf(
    LINES, ALL.values[:, :, [0, 1, 0]] * [1, 1, 3j], ALL.outputs, (*PATHS, "GeM x"), ALL.unit
)
MOTION = spectrum("m", PATHS)


def inverted(response=RESPONSE, matrix=ACCELERANCE):
    return forces_by_inversion(matrix, response)


def validated(validation=VALIDATION, response=RESPONSE):
    return validate_on_board(validation, FORCES, response)


# uncertainty

CASE, FRF = case(), frf()
NO_ANSWER = frf(lines=np.arange(20.0, 61.0), value=0j)


def data(cases=(CASE,), transfers=(FRF, FRF), band=(20.0, 60.0)):
    vehicles = [Vehicle(f"V-{k}", "V", transfer) for k, transfer in enumerate(transfers, 1)]
    return UncertainData(Fleet(tuple(vehicles)), cases, (run_noise("test", 0.01),), band)


REFUSED = [
    # runs and load cases
    *(
        ("tolerances: shaker_gain is", lambda v=v: Tolerances(shaker_gain=v))
        for v in (-0.1, np.inf, np.nan)
    ),
    *(
        ("tolerances: hammer_gain is", lambda v=v: PlacementTolerances(hammer_gain=v))
        for v in (0.0, -0.1, np.nan, np.inf)
    ),
    ("g5", lambda: run(np.zeros(2))),
    ("g5", lambda: run(NOT_FINITE)),
    ("TSM x of M1: deflection: numbers must", lambda: curve([1e-3, 1e-3], [-75.0, 75.0])),
    ("static curve TSM x of M1: force: shape", lambda: curve([0.0, 1e-3], [0.0, 0.0, 0.0])),
    ("g5: its engine torque was not recorded: add its table", lambda: case().wheel_torque),
    (r"shape \(2,\), expected one value for each of 3", lambda: case(engine_torque=np.ones(2))),
    ("g5: engine_torque: shape", lambda: case(engine_torque=np.ones((3, 1)))),
    ("engine_torque: a number is not finite", lambda: case(engine_torque=NOT_FINITE)),
    ("channels .* and force channels .* differ", lambda: case(force=spectrum("N", ["M x", "M y"]))),
    ("frequency axes of displacement and", lambda: case(force=spectrum("N", lines=LINES + 1))),
    ("force is in kN, expected N", lambda: case(force=spectrum("kN"))),
    # force transfer
    ("mount Du left: there is no shaker run along y, z", lambda: shaken(X)),
    ("along z;", lambda: shaken(X, Y, ("z", {"piece": "right"}))),
    (r"\('x', 1\)\] \(axis, repeat\)", lambda: shaken(X, X, Y, Z)),
    ("no force cell below it", lambda: shaken(X, Y, Z, cells=())),
    ("different frequency lines", lambda: shaken(X, Y, ("z", {"lines": LINES + 1}))),
    ("do not tell the directions", lambda: shaken(X, ("y", {"column": [1, 0, 0]}), Z)),
    (
        r"lacks the cell channels \['C1 z'\]",
        lambda: shaken(X, Y, ("z", {"channels": ("C1 x", "C1 y", "C9 z")})),
    ),
    # position sheets and virtual points
    (
        r"A1, A2 show only 5 of 6 motions.*length 0.1 m.*about the axis \(.*0.707.*three triaxial",
        lambda: virtual_point(sensor_geometry(SENSORS[:2])),
    ),
    (r"through \(0, 0.2, 0\) m", lambda: virtual_point(sensor_geometry(ON_A_LINE))),
    ("no channels .'A9 x'.", lambda: sensor_geometry(SENSORS, switched_off=("A9 x",))),
    ("duplicated sensor", lambda: sensor_geometry([SENSORS[0], SENSORS[0]])),
    ("three coordinates", lambda: sensor_geometry(SENSORS, (0.0, 0.0))),
    ("sensors of one kind", lambda: sensor_geometry([*SENSORS, CELL])),
    ("all of them are switched off", lambda: conditioning(sensor_geometry([]))),
    ("at the virtual point", lambda: conditioning(sensor_geometry([sensor("A1", (0, 0, 0))]))),
    ("length 2", lambda: Impact("I1", (0, 0, 0), (0, 0, 2.0))),
    ("I1: position: shape", lambda: Impact("I1", (0, 0), (0, 0, 1.0))),
    ("levers: shape", lambda: replace(STRUCK, levers=np.zeros((2, 3)))),
    ("12 are needed, not 2", lambda: replace(STRUCK, owners=("A1", "A2"))),
    ("responses, of the excitation, or both", lambda: virtual_point_frf(frf())),
    # inertances of a compressor
    ("line at 0 Hz", lambda: replace(TEST, frf=replace(TEST.frf, frequency=LINES - 20))),
    (r"shape \(3, 12, 5\)", lambda: replace(TEST, coherence=np.ones((3, 12, 5)))),
    ("not finite", lambda: replace(TEST, coherence=np.nan * COHERENCE)),
    ("between 0 and 1", lambda: replace(TEST, coherence=1.2 * COHERENCE / 0.9)),
    ("mount 1: stiffness is 0.0: give", lambda: replace(MOUNT, stiffness=[1.0, 0.0, 1.0])),
    ("mount 1: position: shape", lambda: replace(MOUNT, position=np.zeros(2))),
    # noise transfer
    (
        "show only 5 of 6 motions",
        lambda: noise_transfer_at_points(frf(TWO_PLACES.channels), {"TSM": TWO_PLACES}),
    ),
    ("no virtual point", lambda: noise_transfer_at_points(frf(), {})),
    ("no input named", lambda: noise_transfer_at_points(frf(), {"TSM": STRUCK})),
    ("calibrate the loudspeaker's", lambda: reciprocal_noise_transfer(frf(unit="(m/s^2)/V"))),
    (
        "a noise transfer function is in Pa/N",
        lambda: noise_transfer_of_paths(frf(unit="Pa/mm"), {"M x": ["M x"]}),
    ),
    (
        r"path 'EnM x' has no noise transfer function of",
        lambda: noise_transfer_of_paths(frf(), {"EnM x": ["EnM x"]}),
    ),
    ("any piece", lambda: noise_transfer_of_paths(frf(), {"EnM x": []})),
    ("no output named", lambda: noise_transfer_of_paths(frf(), {"M x": ["M x"]}, "rear ear")),
    # quality
    ("no channel shows any signal", lambda: quality.geometric_consistency(POINT, SILENT)),
    ("no channel shows any signal", lambda: quality.response_consistency(POINT, SILENT)),
    ("said about a culprit", lambda: culprit_of_responses(POINT, SILENT, Tolerances())),
    (r"at 30 Hz", lambda: quality.response_consistency(POINT, ONE_SILENT_LINE)),
    (
        "12 channels need lines of shape",
        lambda: find_culprit(POINT.geometry, np.ones((4, 11)), Tolerances()),
    ),
    (r"shapes \(1,\) and \(2,\) differ", lambda: quality.likeness([1.0], [1.0, 2.0])),
    ("as many inputs as outputs", lambda: quality.reciprocity(square(2, 3))),
    ("driving point function of o0 is 0", lambda: quality.reciprocity(square(2, 2, zero=True))),
    ("as many inputs as outputs", lambda: quality.passivity(square(2, 3), FrfForm.INERTANCE, 1.0)),
    ("is positive, not 0.0 m", lambda: quality.passivity(square(2, 2), FrfForm.INERTANCE, 0.0)),
    (
        "driving point function of o0 is 0",
        lambda: quality.passivity(square(2, 2, zero=True), FrfForm.INERTANCE, 1.0),
    ),
    # forces of the paths
    (
        r"no response of the indicators of \['dash'\]",
        lambda: inverted(RESPONSE.select(["rail", "strut"])),
    ),
    ("other frequency lines", lambda: inverted(replace(RESPONSE, frequency=LINES + 1))),
    ("of the indicators are in m/s:", lambda: inverted(replace(RESPONSE, unit="m/s"))),
    ("2 unknown forces from 1 indicators", lambda: inverted(matrix=ALL.select(outputs=["roof"]))),
    (r"forces at \['TSM x', 'GeM x'\] .*3 lines", lambda: inverted(matrix=TWICE)),
    (
        "force at EnM x moves no indicator",
        lambda: inverted(matrix=replace(ALL, values=ALL.values * [1, 0])),
    ),
    (
        "0 Hz",
        lambda: inverted(
            replace(RESPONSE, frequency=LINES - 20), replace(ALL, frequency=LINES - 20)
        ),
    ),
    (
        r"no receiver displacement of \['EnM x'\]",
        lambda: forces_by_mount_stiffness(spectrum("N/m", PATHS), MOTION, MOTION.select(PATHS[:1])),
    ),
    ("mount stiffness is in m", lambda: forces_by_mount_stiffness(MOTION, MOTION, MOTION)),
    (r"\['strut'\] were indicators", lambda: validated(ALL.select(outputs=("strut", "roof")))),
    (r"paths \['EnM x'\] to the", lambda: validated(VALIDATION.select(inputs=PATHS[:1]))),
    (
        r"\['roof'\] measured nothing",
        lambda: validated(response=replace(RESPONSE, values=RESPONSE.values * (np.arange(5) < 4))),
    ),
    ("which measured m:", lambda: validated(response=replace(RESPONSE, unit="m"))),
    (
        "different frequency lines",
        lambda: validated(response=replace(RESPONSE, frequency=LINES + 1)),
    ),
    # uncertainty
    (
        "other has other channels, paths or lines",
        lambda: data(cases=(case(), case("other", LINES[1:]))),
    ),
    ("V-2 has other channels", lambda: data(transfers=(frf(), frf(("M x", "M y"))))),
    ("no line between 200 and 300 Hz", lambda: data(band=(200.0, 300.0)).measured),
    ("39 draws do not give an interval", lambda: pivotal_interval(1.0, np.ones(39))),
    ("one row per draw", lambda: pivotal_interval([1.0, 2.0], np.ones((50, 3)))),
    ("finite values", lambda: pivotal_interval(1.0, np.full(50, -np.inf))),
    ("a coverage of 90.0", lambda: pivotal_interval(1.0, np.ones(50), 90.0)),
    ("at least one vehicle", lambda: method_difference([])),
    ("vehicle 1: its two", lambda: method_difference([(frf(), frf(("M x", "M y")))])),
    ("at least two paths", lambda: method_difference([(frf(("M x",)), frf(("M x",)))])),
    ("without any answer", lambda: method_difference([(NO_ANSWER, NO_ANSWER)])),
]


@pytest.mark.parametrize(("sentence", "call"), REFUSED)
def test_what_does_not_fit_is_refused(sentence, call):
    with pytest.raises(InputError, match=sentence):
        call()


def test_what_fits_is_taken_and_stays_as_it_is():
    torque = np.array([10.0, 20.0, 40.0])
    loaded = case(engine_torque=torque)
    torque[0] = -1.0  # the caller's array stays the caller's
    np.testing.assert_allclose(loaded.wheel_torque, [34.0, 68.0, 136.0])
    transfer = shaken(X, Y, Z, ("x", {"piece": "right"}))
    assert transfer.channels() == ("Du left x", "Du left y", "Du left z")
    assert transfer.repeats == (1, 1, 1)
    for array in (
        loaded.engine_torque,
        curve([-1e-3, 1e-3], [-75.0, 75.0]).force,
        transfer.matrix,
        FORCES.inversion.force,
    ):
        with pytest.raises(ValueError, match="read-only"):
            array[...] = 0.0
    drawing = compressor_test.Drawing(6.8, np.zeros(3), np.eye(3), (MOUNT,))
    assert replace(TEST, drawing=drawing).drawing.mounts[0].name == "mount 1"


def test_a_calibration_seen_on_two_vehicles_keeps_its_prior():
    generator, lines = np.random.default_rng(1), np.arange(20.0, 61.0)

    def noisy():
        clean, noise = frf(lines=lines), generator.normal(size=(2, lines.size, 1, 2))
        return replace(clean, values=clean.values + 0.01 * (noise[0] + 1j * noise[1]))

    few, enough = (
        transfer_sources(method_difference([(noisy(), noisy()) for _ in range(n)]), "two ways")
        for n in (2, 3)
    )
    prior = transfer_sources()[0]
    assert (few[0].name, few[0].size, few[0].origin) == (prior.name, prior.size, "stated prior")
    assert {source.origin for source in few[1:]} == {"two ways"}
    assert float(enough[0].size.split()[0]) < 0.2
    assert {source.origin for source in enough} == {"two ways"}


ORDER = [
    "conditioning",
    "redundancy",
    "geometric consistency",
    "specific consistency",
    "overall consistency",
    "reciprocity",
    "passivity",
    "leave-one-out",
]


@pytest.fixture(scope="module")
def hammer():
    generator = np.random.default_rng(21)
    test = draw_hammer_test(generator)
    response = virtual_point(sensor_geometry(test.sensors))
    return test, response, virtual_point(impact_geometry(test.impacts)), generator


def reversed_channel(test, generator):
    fault = InjectedFault(Fault.SIGN, "A2", ("A2 y",), np.zeros(3))
    return measure(test, generator, fault=fault)


def by_name(checks):
    return {check.name.split(",")[0].split(" (")[0]: check for check in checks}


def report(hammer, measured, **options):
    _, response, excitation, _ = hammer
    return quality.quality_of_frf(
        response, excitation, measured, FrfForm.INERTANCE, tolerances=EXACT, **options
    )


def test_a_good_measurement_keeps_all_limits_in_the_stated_order(hammer):
    test, _, _, generator = hammer
    measured = measure(test, generator)
    checks = report(hammer, measured)
    assert [check.passed for check in checks] == [True] * len(checks)
    ranks = [next(k for k, word in enumerate(ORDER) if c.name.startswith(word)) for c in checks]
    assert sorted(set(ranks)) == list(range(len(ORDER)))
    firsts = [ranks.index(rank) for rank in range(len(ORDER))]
    assert firsts == sorted(firsts)
    assert all(check.culprit for check in checks)


def test_a_reversed_channel_is_flagged_and_named(hammer):
    test, _, _, generator = hammer
    checks = by_name(report(hammer, reversed_channel(test, generator)))
    for name in ("geometric consistency", "specific consistency of sensors"):
        assert checks[name].passed is False
        assert checks[name].culprit == "A2 y"
    assert checks["passivity"].passed is False
    named = checks["leave-one-out of sensors"]
    assert named.passed is False
    assert named.culprit.startswith("A2 y: reversed sign")
    assert checks["leave-one-out of impacts"].passed is True
    assert checks["conditioning of sensors"].passed is True


def test_operation_lists_what_it_cannot_check(hammer):
    test, response, _, generator = hammer
    push = measure(test, generator).select(inputs=["I01"])
    run = Spectrum(push.frequency, push.values[:, :, 0], push.outputs, "m/s^2")
    checks = by_name(quality.quality_in_operation(response, run, tolerances=EXACT))
    unchecked = {name: c.culprit for name, c in checks.items() if c.passed is None}
    assert unchecked == {
        "reciprocity": "needs frequency response functions",
        "passivity": "needs frequency response functions",
    }


def test_points_apart_have_no_driving_point(hammer):
    test, response, _, generator = hammer
    elsewhere = virtual_point(impact_geometry(test.impacts, (0.1, 0.0, 0.0)))
    checks = quality.quality_of_frf(
        response, elsewhere, measure(test, generator), FrfForm.INERTANCE
    )
    assert [c.passed for c in checks if c.name in ("reciprocity", "passivity")] == [None, None]


def test_a_poor_sheet_is_reported_before_measuring(hammer):
    two = sensor_geometry(hammer[0].sensors[:2])
    conditioning, redundancy = quality.quality_of_sheet(two)
    assert conditioning.number == np.inf
    assert conditioning.passed is False
    assert conditioning.culprit.startswith("rotation about the axis")
    assert "mm" in conditioning.name
    assert redundancy.passed is False or redundancy.number > 0


def test_the_table_has_a_row_per_check(hammer):
    test, _, _, generator = hammer
    _, response, _, _ = hammer
    apart = virtual_point(impact_geometry(test.impacts, (0.1, 0.0, 0.0)))
    faulty = reversed_channel(test, generator)
    checks = quality.quality_of_frf(response, apart, faulty, FrfForm.INERTANCE)
    table = quality.quality_table(checks)
    assert [row["check"] for row in table] == [check.name for check in checks]
    assert set(table[0]) == {"check", "number [1]", "limit", "verdict", "worst"}
    verdicts = {row["check"]: row["verdict"] for row in table}
    assert verdicts["passivity"] == "not checked"
    assert verdicts["geometric consistency (error)"] == "look here"
    limits = {row["check"]: row["limit"] for row in table}
    assert limits["geometric consistency (error)"] == "≤ 0.02"
    assert limits["specific consistency of sensors"] == "≥ 0.75"
    assert limits["passivity"] == ""


def test_small_pairs_are_not_accused():
    values = np.tile(np.diag([1.0, 2.0]).astype(complex), (3, 1, 1))
    values[:, 0, 1], values[:, 1, 0] = 0.01, -0.01
    small = quality.reciprocity(Frf([1.0, 2.0, 3.0], values, ("x", "y"), ("fx", "fy"), "m/N"))
    assert small.worst() == ("", 1.0)
    assert small.worst(smallest=0.0) == ("x–y", 0.0)


def test_tolerances_that_nobody_states_are_those_of_the_sensors_classes():
    assert vars(Tolerances()) == {name: CLASS_DEFAULTS[name].value for name in vars(Tolerances())}
    place = (0.0015, math.radians(1.5))
    assert astuple(PlacementTolerances()) == (0.02, *place, 0.01, *place)
