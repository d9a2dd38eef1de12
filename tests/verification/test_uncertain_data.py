"""Errors that are drawn, against closed forms: one path, linear levels, known variances."""

from types import SimpleNamespace

import numpy as np
import pytest

from deboom.measurement import uncertainty
from deboom.measurement.channels import Frf, LoadCase, Spectrum
from deboom.measurement.sensors import Tolerances
from deboom.mounts.characterised_mount import DirectionQuality
from deboom.mounts.error_budget import TWO_SIDED
from deboom.mounts.mount import Mount
from deboom.physics.dynamic_stiffness import dynamic_stiffness
from deboom.physics.transfer_path import pressure as summed_pressure
from deboom.vehicles import uncertain_data
from deboom.vehicles.booming_model import BoomingModel, booming_model
from deboom.vehicles.fleet import Fleet, PathContributions, Vehicle, path_contributions
from deboom.vehicles.platform_uncertainty import force_sources
from deboom.vehicles.uncertain_data import MeasuredArrays, transfer_floor, transfer_paths

LINES = np.linspace(20.0, 60.0, 81)
BAND = (20.0, 60.0)
DB = 20 / np.log(10)


def one_path(*sources, axes=("x",)):
    """Two vehicles, one mount; with one axis the level is linear in the logarithm of all errors."""
    generator = np.random.default_rng(5)
    mount = Mount("M", "", ("",), ((0.2, 0.0, 0.1),), axes)
    shape = (LINES.size, len(axes))
    complex_values = generator.normal(size=(4, 2, *shape)) @ np.eye(len(axes))
    values = 1.0 + 0.2 * (complex_values[:, 0] + 1j * complex_values[:, 1])
    paths = tuple(f"M {axis}" for axis in axes)
    vehicles = [
        Vehicle(name, "V", Frf(LINES, 1e-2 * v[:, np.newaxis], ("ear",), paths, "Pa/N"))
        for name, v in zip(("V-1", "V-2"), values, strict=False)
    ]
    case = LoadCase(
        "run",
        "",
        5,
        3.4,
        220.0,
        1.5,
        Spectrum(LINES, 1e-4 * values[2], paths, "m"),
        Spectrum(LINES, 30.0 * values[3], paths, "N"),
    )
    return uncertain_data.UncertainData(Fleet(tuple(vehicles)), (case,), sources, BAND), mount


def levels(data, mount, draw=None, seed=1, only=None):
    fleet, cases = data.measured if draw is None else data.drawn(draw, seed, only)
    index = booming_model(fleet, (mount,), [(cases[0], 1.0)], BAND)
    designs = np.ones((2, 3))
    designs[1, 0] = 0.8
    return index(designs) / index.n_lines


@pytest.mark.slow("prepares shipped data again and again")
def test_a_calibration_moves_every_level_by_its_decibels_and_no_change():
    source = uncertain_data.transfer_calibration("test", 0.5)
    data, mount = one_path(source)
    measured = levels(data, mount)

    moved = np.array([levels(data, mount, draw) - measured for draw in range(300)])

    drawn = [
        uncertain_data.own_generator(source, 1, n).standard_normal((2, 1, 1))[:, 0, 0]
        for n in range(300)
    ]
    assert np.allclose(moved[:, 0], 0.5 * np.array(drawn), atol=1e-10)
    assert np.allclose(moved[:, 1], moved[:, 0], atol=1e-10)
    # variance of 300 draws: within 3.3 standard errors of the stated one
    assert moved[:, 0].var(axis=0) == pytest.approx(0.25, rel=3.3 * np.sqrt(2 / 300))
    # of a deviation from few data it is that of Student's t
    data, mount = one_path(uncertain_data.transfer_calibration("test", 0.5, 6.0))
    moved = np.array([levels(data, mount, draw) - measured for draw in range(300)])
    assert moved[:, 0].var(axis=0) == pytest.approx(0.25 * 6 / 4, rel=0.2)


def test_the_level_of_one_path_is_linear_in_the_logarithm_of_its_stiffness():
    source = uncertain_data.stiffness_error(
        uncertain_data.BUDGET, "test", {"M x": 0.03}, {"M x": ("M x",)}
    )
    data, mount = one_path(source)
    measured = levels(data, mount)

    for draw in range(5):
        along, _ = uncertain_data.own_generator(source, 1, draw).standard_normal(2)
        moved = levels(data, mount, draw) - measured
        assert np.allclose(moved, DB * 0.03 * along, atol=1e-10)


def test_alignment_and_rest_make_the_stated_budget():
    data, mount = one_path(axes=("x", "y"))
    direction = SimpleNamespace(axis="x", quality=DirectionQuality(True, 0.1))
    part = SimpleNamespace(mount=mount, directions=[direction])
    tolerances = Tolerances(shaker_angle=0.03)
    sources = force_sources((mount,), data.load_cases, (part,), BAND, tolerances)[:2]
    data, sizes = one_path(*sources, axes=("x", "y"))[0], []
    measured = data.load_cases[0].force.values
    leak = 0.03 * np.sqrt(np.median(np.abs(measured[:, 1] / measured[:, 0]) ** 2))
    for source in sources:
        along, _ = uncertain_data.own_generator(source, 1, 3).standard_normal(2)
        moved = data.drawn(3, 1, [source.name])[1][0].force.values[0, 0]
        sizes.append(np.log(np.abs(moved / measured[0, 0])) / along)
    np.testing.assert_allclose(sizes, [np.sqrt((0.1 / TWO_SIDED) ** 2 - leak**2), leak])


def test_line_by_line_noise_averages_over_the_lines():
    relative = 0.02
    data, mount = one_path(uncertain_data.run_noise("test", relative))
    measured = levels(data, mount)
    moved = np.array([levels(data, mount, draw) - measured for draw in range(300)])

    # half of the variance of a complex error lies along the magnitude
    expected = (DB * relative) ** 2 / 2 / LINES.size
    assert moved[:, 0].var(axis=0) == pytest.approx(expected, rel=0.28)
    assert np.allclose(moved[:, 0, 0], moved[:, 0, 1])  # one run, heard in both vehicles


def test_a_smooth_error_has_its_correlation_and_its_variance_in_a_mean():
    length, relative = 8.0, 0.01
    basis = uncertain_data.smooth_basis(LINES, length)
    correlation = np.exp(-(((LINES[:, None] - LINES) / length) ** 2) / 2)
    assert np.allclose(basis @ basis.T, correlation, atol=1e-5)

    data, mount = one_path(uncertain_data.transfer_paths("test", relative, length))
    flat = np.ones((LINES.size, 1, 1)) * 1e-2
    vehicles = [
        Vehicle(v.name, v.group, Frf(LINES, flat, ("ear",), ("M x",), "Pa/N"))
        for v in data.fleet.vehicles
    ]
    data = uncertain_data.UncertainData(Fleet(tuple(vehicles)), data.load_cases, data.sources, BAND)
    measured = levels(data, mount)
    moved = np.array([levels(data, mount, draw) - measured for draw in range(400)])[:, 0]

    expected = (DB * relative) ** 2 / 2 * correlation.mean()
    assert moved.var() == pytest.approx(expected, rel=0.2)


def test_a_shaker_that_points_elsewhere_leaks_the_other_axes():
    source = uncertain_data.force_cells("test", {"M": 0.0}, {"M": 0.01}, ("M x",))
    data, _ = one_path(source, axes=("x", "y", "z"))
    (measured,), (again,) = data.measured[1], data.drawn(0, 1)[1]

    difference = again.force.values - measured.force.values
    assert np.all(difference[:, 1:] == 0)
    fitted, *_ = np.linalg.lstsq(measured.force.values[:, 1:], difference[:, 0])
    assert np.allclose(measured.force.values[:, 1:] @ fitted, difference[:, 0])
    assert np.allclose(fitted.imag, 0)
    assert np.all(np.abs(fitted.real) < 0.05)


def test_the_phase_of_a_stiffness_errs_by_its_losses():
    names = {"M x": ("M x",), "M y": ("M y",)}
    source = uncertain_data.stiffness_error("K", "test", {"M x": 0.02, "M y": 0.05}, names)
    assert source.size == "2 to 5 %"
    data, _ = one_path(source, axes=("x", "y"))
    force = np.array([data.drawn(n, 1)[1][0].force.values[0] for n in range(300)])
    gain = np.log(force / data.measured[1][0].force.values[0])
    assert gain.real.std(axis=0) == pytest.approx([0.02, 0.05], rel=0.1)
    losses = 0.2 * np.sqrt(2) * np.array([0.02, 0.05])
    assert gain.imag.std(axis=0) == pytest.approx(losses, rel=0.2)


def test_a_wrong_motion_moves_the_force_of_a_surface_and_not_a_measured_one():
    source = uncertain_data.motion_error("test", {"M": 0.02}, {"M": 0.02}, ("M x",))
    data, _ = one_path(source, axes=("x", "y", "z"))
    (measured,), (again,) = data.measured[1], data.drawn(3, 1)[1]

    stiffness = measured.force.values[:, 0] / measured.displacement.values[:, 0]
    assert np.allclose(again.force.values[:, 0], stiffness * again.displacement.values[:, 0])
    assert np.array_equal(again.force.values[:, 1:], measured.force.values[:, 1:])
    assert np.all(again.displacement.values != measured.displacement.values)


def test_a_source_draws_the_same_alone_and_among_others():
    calibration, floor = (
        uncertain_data.transfer_calibration("", 0.5),
        uncertain_data.transfer_floor("", 1e-4),
    )
    both, mount = one_path(calibration, floor)
    alone, _ = one_path(calibration)

    assert np.array_equal(levels(both, mount, 7, only=[calibration.name]), levels(alone, mount, 7))
    assert not np.array_equal(levels(both, mount, 7), levels(both, mount, 8))
    assert np.array_equal(levels(both, mount, 7), levels(both, mount, 7))


def test_a_pivot_takes_a_bias_away_instead_of_twice():
    generator = np.random.default_rng(1)
    errors = generator.normal(0.3, 1.0, 20_000)

    interval = uncertainty.pivotal_interval(10.0, 10.0 + errors)

    assert interval.lower == pytest.approx(10 - 0.3 - 1.645, abs=0.05)
    assert interval.upper == pytest.approx(10 - 0.3 + 1.645, abs=0.05)
    assert interval.holds(9.7)
    assert uncertainty.probability_below(10.0, 10.0 + errors, 9.7) == pytest.approx(0.5, abs=0.02)
    assert interval.about(5.0).upper == pytest.approx(float(interval.upper) - 5.0)


def test_student_t_counts_few_vehicles():
    # GUM, table G.2: t for 95.45 % and 4 degrees of freedom is 2.87
    assert uncertainty.half_width([uncertainty.VariancePart("a", 4.0, 4)], 0.9545) == pytest.approx(
        2 * 2.87, rel=2e-3
    )
    # GUM, G.4.1: two parts of which one is known for certain
    parts = [uncertainty.VariancePart("a", 1.0, 9), uncertainty.VariancePart("b", 1.0)]
    assert uncertainty.half_width(parts, 0.95) == pytest.approx(
        np.sqrt(2) * 2.028, rel=2e-3
    )  # ν = 36
    stated = [uncertainty.VariancePart("a", 9.0), uncertainty.VariancePart("b", 16.0)]
    halved = uncertainty.NextMeasurement("b once more", {"b": 0.5}, {})
    assert uncertainty.half_width_after(stated, halved) == pytest.approx(
        1.6449 * np.sqrt(17), rel=1e-4
    )


def test_the_spread_of_a_table_splits_into_rows_columns_and_rest():
    generator = np.random.default_rng(2)
    rows, columns, rest = 2.0, 1.0, 0.5
    table = (
        generator.normal(0, rows, (7, 1, 3000))
        + generator.normal(0, columns, (1, 6, 3000))
        + generator.normal(0, rest, (7, 6, 3000))
    )
    spread = uncertainty.crossed_spread(table)
    assert spread.rows.mean() == pytest.approx(rows**2, rel=0.05)
    assert spread.columns.mean() == pytest.approx(columns**2, rel=0.05)
    assert spread.rest.mean() == pytest.approx(rest**2, rel=0.05)
    exact = uncertainty.crossed_spread([[1.0, 2.0], [3.0, 5.0]])
    assert (exact.rows, exact.columns, exact.rest) == (3.0, 1.0, 0.25)
    alone = uncertainty.crossed_spread([[1.0], [3.0]])
    assert (alone.rows, alone.columns) == (2.0, 0.0)


def test_two_methods_tell_their_calibration_body_paths_and_floor():
    generator = np.random.default_rng(3)
    calibration, path, length, body, body_length, floor = 0.6, 0.05, 6.0, 0.04, 4.0, 3e-5
    lines = np.linspace(20.0, 60.0, 161)
    basis, of_body = (
        uncertain_data.smooth_basis(lines, length),
        uncertain_data.smooth_basis(lines, body_length),
    )
    ramp = np.linspace(1.0, 2.0, lines.size)[:, np.newaxis]
    smooth = 1e-2 * ramp * np.exp(0.1j * lines[:, np.newaxis] * np.arange(10))

    def normal(*shape):
        parts = generator.normal(size=(2, *shape)) / np.sqrt(2)
        return parts[0] + 1j * parts[1]

    def measured():
        values = smooth * (1 + path * basis @ normal(basis.shape[1], 10))
        values = values * (1 + body * of_body @ normal(of_body.shape[1], 1))
        values = values * 10 ** (generator.normal(0, calibration) / 20)
        values = values + np.sqrt(2) * floor * normal(lines.size, 10)
        values[5, 3] = 0.0  # one silent line is no silent path
        return Frf(
            lines, values[:, np.newaxis], ("ear",), tuple(f"M{k} x" for k in range(10)), "Pa/N"
        )

    difference = uncertainty.method_difference([(measured(), measured()) for _ in range(60)])

    # of the mean of both methods
    assert difference.calibration_db == pytest.approx(calibration / np.sqrt(2), rel=0.25)
    # its mean over the band counts as calibration
    assert difference.body == pytest.approx(body / np.sqrt(2), rel=0.15)
    assert difference.body_length == pytest.approx(body_length, rel=0.25)
    assert difference.path == pytest.approx(path / np.sqrt(2), rel=0.1)
    assert difference.length == pytest.approx(length, rel=0.25)
    assert difference.floor == pytest.approx(floor / np.sqrt(2), rel=0.05)
    assert difference.calibration_degrees_of_freedom == 60


def test_what_all_paths_share_moves_no_change_of_all_mounts():
    data, mount = one_path(uncertain_data.transfer_body("test", 0.05, 3.0))
    measured = levels(data, mount)
    moved = levels(data, mount, 0) - measured
    assert np.all(np.abs(moved) > 1e-3)
    assert np.allclose(moved[1], moved[0], atol=1e-10)


def test_two_paths_by_hand():
    """At 1 kHz, where A is 0 dB, and at 100 Hz, where IEC 61672-1 gives -19.1 dB."""
    values = np.array([[[3e-3, 4e-3j], [3e-3, 4e-3j]]])
    case = PathContributions("g5", np.array([100.0, 1000.0]), values, ("A",), ("TSM x", "Du x"))
    index = BoomingModel((case,), (1.0,))
    # |p| = 5 mPa: 20 lg(5e-3 / (√2 · 2e-5)) = 20 lg 176.7767 = 44.9485 dB
    # |p| = 3 mPa with the second path off: 20 lg 106.0660 = 40.5115 dB
    # |p| = |1.5 + 8j| mPa: 20 lg 287.7716 = 49.1810 dB
    indices = index([[1.0, 1.0], [1.0, 0.0], [0.5, 2.0]])[:, 0]
    unweighted = 2 * np.array([44.9485, 40.5115, 49.1810])
    assert np.ptp(indices - unweighted) < 3e-4
    np.testing.assert_allclose(indices - unweighted, -19.1, atol=0.05)


def test_prescribed_motion_scales_the_stiffness_of_each_piece():
    """``p = Σ_paths Y Σ_pieces x K s`` with K = f/s of each line and piece."""
    rng = np.random.default_rng(1)
    frequency = np.linspace(20.0, 60.0, 41)
    channels = ("TSM x", "TSM z", "Du left x", "Du right x")
    paths = ("TSM x", "TSM z", "Du x")
    mounts = (
        Mount("TSM", "strut", ("",), ((0.2, 0.0, -0.3),), ("x", "z")),
        Mount("Du", "wishbone", ("left", "right"), ((0, -0.7, 0), (0, 0.7, 0)), ("x",)),
    )

    def random(*shape):
        return rng.normal(size=shape) + 1j * rng.normal(size=shape)

    motion, force = 1e-4 * random(41, 4), 100 * random(41, 4)
    case = LoadCase(
        "g5",
        "5th gear",
        5,
        3.4,
        220.0,
        1.5,
        Spectrum(frequency, motion, channels, "m"),
        Spectrum(frequency, force, channels, "N"),
    )
    ntf = 1e-3 * random(41, 1, 3)
    fleet = Fleet((Vehicle("A-1", "A", Frf(frequency, ntf, ("ear",), paths, "Pa/N")),))

    design = rng.uniform(0.8, 1.2, 6)
    factor = dict(zip(("TSM x", "TSM y", "TSM z", "Du x", "Du y", "Du z"), design, strict=True))
    stiffness = dynamic_stiffness(force, motion)
    scale = [factor["TSM x"], factor["TSM z"], factor["Du x"], factor["Du x"]]
    piece = stiffness * scale * motion
    path = np.column_stack([piece[:, 0], piece[:, 1], piece[:, 2] + piece[:, 3]])
    expected = summed_pressure(ntf[:, 0], path)

    contributions = path_contributions(fleet, mounts, case)
    assert contributions.variable_names == tuple(factor)
    assert not contributions.values[..., [1, 4, 5]].any()
    pressure = contributions.pressure(design[np.newaxis])[0, 0]
    np.testing.assert_allclose(pressure, expected, rtol=1e-12)
    level = 20 * np.log10(np.abs(expected) / (np.sqrt(2) * 20e-6)) + _weighting(frequency)
    index = booming_model(fleet, mounts, [(case, 2.0)], (20.0, 60.0))
    assert index(design[np.newaxis])[0, 0] == pytest.approx(level.sum(), abs=41 * 0.005)


def _weighting(frequency):
    """A-weighting with the rounded poles that the standard prints, good to 0.005 dB."""
    f2 = frequency**2
    ratio = 12194**2 * f2**2 / ((f2 + 20.60**2) * (f2 + 12194**2))
    return 20 * np.log10(ratio / np.sqrt((f2 + 107.7**2) * (f2 + 737.9**2))) + 2.000


def arrays_of(transfer):
    """Make data of which only noise transfer functions are measured again."""
    return MeasuredArrays(
        **{
            name: None
            for name in MeasuredArrays.__dataclass_fields__
            if name not in ("transfer", "frequency", "transfer_around", "vehicle_of", "floor")
        },
        transfer=transfer,
        frequency=np.arange(float(transfer.shape[1])),
        transfer_around=np.abs(transfer),
        vehicle_of=np.arange(len(transfer)),
        floor=np.full(transfer.shape[:2], np.nan),
    )


def test_the_noise_floor_is_that_of_the_real_and_of_the_imaginary_part():
    quiet = arrays_of(np.zeros((1, 200, 200), dtype=complex))
    drawn = transfer_floor("stated", 2e-5).measured_again(quiet, np.random.default_rng(1)).transfer
    assert drawn.real.std() == pytest.approx(2e-5, rel=0.02)
    assert drawn.imag.std() == pytest.approx(2e-5, rel=0.02)


def test_an_error_known_from_few_measurements_is_students():
    """Mean square of Student's t with 6 degrees of freedom: 6/4 of the stated."""
    data, rng = arrays_of(np.ones((1, 3, 40), dtype=complex)), np.random.default_rng(1)
    paths = transfer_paths("found", 0.01, 1e-3, degrees_of_freedom=6.0)
    drawn = (paths.measured_again(data, rng).transfer for _ in range(3000))
    squares = [np.mean(np.abs(transfer - 1) ** 2) for transfer in drawn]
    assert np.mean(squares) / 0.01**2 == pytest.approx(1.5, rel=0.06)
