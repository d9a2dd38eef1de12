"""Identification against known truth."""

import numpy as np
import pytest
from compressor_operation_samples import sheet

from deboom.bench.compressor_truth import CompressorPlan
from deboom.bench.compressor_writer import write_compressor_test
from deboom.choices import CalibrationLevel, CompressorCase
from deboom.compressor.calibrate import (
    Placement,
    RawInertance,
    deviation_from_coherence,
)
from deboom.compressor.identifiability import (
    gain_deviation,
    identifiability,
    quantities,
    quantity_deviations,
)
from deboom.compressor.identify import (
    IdentifyOptions,
    frac,
    identify,
    modal_likeness,
)
from deboom.compressor.model import CompressorModel, GainFactor, mounts_at_virtual_point
from deboom.compressor.mount_shares import mount_shares
from deboom.compressor.parameters import MinimalParameters, ThesisParameters
from deboom.compressor.thesis_fit import (
    fit_thesis_parameters,
    thesis_bounds,
    thesis_start,
)
from deboom.compressor.virtual_point_fit import (
    Bounds,
    Objective,
    fit_at_virtual_point,
    in_bands,
    inertance_and_apparent_mass,
    linear_start,
    whitened_inertance,
)
from deboom.errors import InputError
from deboom.files.compressor_model import compressor_document
from deboom.files.inertance_test import read_inertance_test
from deboom.measurement.channels import Frf
from deboom.measurement.compressor_test import CompressorMount
from deboom.measurement.sensors import PlacementTolerances
from deboom.study.compressor_identification import (
    TRUTH_FILE,
    read_compressor_truth,
)

LENGTH = 0.055
LINES = np.concatenate([np.arange(10, 40, 1.5), np.arange(40, 151, 8.0)])
TOLERANCES = PlacementTolerances()
INERTIA = np.array([[0.0158, 2e-4, -1.5e-4], [2e-4, 0.0291, 1e-4], [-1.5e-4, 1e-4, 0.0302]])
POSITIONS = np.array([[-0.156, 0.004, 0.020], [-0.019, -0.067, 0.078], [-0.008, 0.074, 0.082]])
ROTATIONS = np.deg2rad([[-4.9, -4.9, 185.0], [2.5, 43.3, 87.5], [2.2, 131.5, 89.4]])
STIFFNESS = 1e3 * np.array([[29.9, 10.8, 12.2], [29.7, 12.9, 11.8], [29.2, 10.6, 10.3]])
MOUNTS = tuple(
    CompressorMount(f"mount {i + 1}", POSITIONS[i], ROTATIONS[i], STIFFNESS[i]) for i in range(3)
)
TRUTH = CompressorModel(
    7.2,
    [0.0015, -0.002, 0.001],
    INERTIA,
    mounts_at_virtual_point(MOUNTS),
    GainFactor.of([1.85, 0.06, 2.2, 0.42, 0.15, 2.5]),
)


def exact_inertance() -> RawInertance:
    """Raw FRFs of the truth at the places of the sheet."""
    sensors, impacts = sheet()
    placement = Placement(sensors, impacts)
    none = np.zeros(len(placement.names))
    forward, wrenches = placement.response_matrix(none), placement.excitation_matrix(none)
    values = forward @ TRUTH.inertance(LINES) @ wrenches.T
    channels = tuple(name for sensor in sensors for name in sensor.channels)
    frf = Frf(LINES, values, channels, tuple(impact.name for impact in impacts), "1/kg")
    return RawInertance(sensors, impacts, frf, np.full(values.shape, 1e-6), 1e-12)


def at_virtual_point(raw: RawInertance) -> Objective:
    placement = Placement(raw.sensors, raw.impacts)
    zero = np.zeros(len(placement.names))
    response = np.linalg.pinv(placement.response_matrix(zero))
    excitation = np.linalg.pinv(placement.excitation_matrix(zero))
    return whitened_inertance(
        raw.frf.frequency,
        response @ raw.frf.values @ excitation.T,
        response,
        excitation,
        raw.deviation[:, 0, 0],
    )


RAW = exact_inertance()


def test_placement_derivatives() -> None:
    sensors, impacts = sheet()
    placement = Placement(sensors, impacts)
    rng = np.random.default_rng(5)
    errors = 3 * placement.deviations(TOLERANCES) * rng.standard_normal(len(placement.names))
    by_response = placement.response_derivatives(errors)
    by_excitation = placement.excitation_derivatives(errors)
    first = 9 * len(sensors)
    for number in rng.choice(len(placement.names), 40, replace=False):
        step = np.zeros(errors.size)
        step[number] = 1e-6
        if number < first:
            difference = placement.response_matrix(errors + step)
            difference = difference - placement.response_matrix(errors - step)
            analytic = by_response[number]
        else:
            difference = placement.excitation_matrix(errors + step)
            difference = difference - placement.excitation_matrix(errors - step)
            analytic = by_excitation[number - first]
        np.testing.assert_allclose(difference / 2e-6, analytic, atol=1e-8)


def thesis_fit_data() -> tuple[Objective, np.ndarray, np.ndarray]:
    start = ThesisParameters().values_of(TRUTH, MOUNTS)
    tolerance = np.concatenate(
        [
            np.full(9, 0.0126),
            np.full(9, np.deg2rad(5.0)),
            np.full(9, 0.35 * 16e3),
            0.1 * np.diag(INERTIA),
            np.full(3, 5e-4),
            np.full(3, 3e-3),
            [0.5],
            0.3 * TRUTH.gain.values,
            [0.3],
        ]
    )
    return at_virtual_point(RAW), start, tolerance


def test_a_fit_in_its_bounds_ends_at_the_truth() -> None:
    data, truth, tolerance = thesis_fit_data()
    bounds = Bounds(truth - tolerance, truth + tolerance)
    start = truth + 0.3 * tolerance
    objective = inertance_and_apparent_mass(data.frequency, data.measured, LENGTH)
    fit = fit_at_virtual_point(ThesisParameters(), objective, start, bounds)
    begun = ThesisParameters().model(start)
    deviations = objective.residuals(begun.apparent_mass(LINES), begun.inertance(LINES))
    assert fit.cost < 1e-6 * 0.5 * np.sum(np.abs(deviations) ** 2)
    assert fit.model.mass == pytest.approx(7.2, rel=1e-3)


def test_deviation_from_the_coherence_of_five_hits() -> None:
    rng = np.random.default_rng(7)
    shape, hits, noise = (200, 18, 6), 5, 0.05
    true = np.full(shape, 1.0 + 0.5j)
    force = np.ones((hits, *shape))
    response = true * force + noise * (
        rng.standard_normal((hits, *shape)) + 1j * rng.standard_normal((hits, *shape))
    )
    cross, auto = response.mean(axis=0), (np.abs(response) ** 2).mean(axis=0)
    frf = Frf(
        np.arange(1.0, 201.0),
        cross,
        tuple(f"c{i}" for i in range(18)),
        tuple(f"i{i}" for i in range(6)),
        "1/kg",
    )
    deviation = deviation_from_coherence(frf, np.abs(cross) ** 2 / auto, hits)
    np.testing.assert_allclose(deviation, noise / np.sqrt(hits), rtol=0.12)
    assert np.median(deviation) == pytest.approx(noise / np.sqrt(hits), rel=0.02)


def fit_from_outside():
    data, values, tolerance = thesis_fit_data()
    bounds = Bounds(values + tolerance, values + 2 * tolerance)
    return fit_at_virtual_point(ThesisParameters(), data, values, bounds)


@pytest.mark.parametrize(
    ("build", "words"),
    [
        (lambda: PlacementTolerances(sensor_gain=0.0), "above 0"),
        (lambda: deviation_from_coherence(RAW.frf, np.ones(RAW.frf.values.shape), 1), "one hit"),
        (lambda: in_bands(LINES, ((200.0, 300.0),)), "no line"),
        (
            lambda: linear_start(MinimalParameters(LENGTH), LINES, -at_virtual_point(RAW).measured),
            "wrong sign",
        ),
        (fit_from_outside, "outside its bounds"),
        (lambda: identifiability(("a", "b"), np.ones((1, 2)), np.ones(2)), "cannot fix"),
    ],
)
def test_what_no_fit_may_swallow(build, words):
    with pytest.raises(InputError, match=words):
        build()


SLACK = 1.5
"""One compressor against a figure that 90 % of compressors meet."""
MODES = np.arange(10.0, 30.5, 0.5)
SCALE = np.repeat([1.0, 1 / 0.055], 3)


def errors(model, true):
    """Centre [m], and relative errors of mass, inertia, dynamic stiffness at 20 Hz, gain shape."""
    weight = np.outer(SCALE, SCALE)
    scale, true_scale = model.gain.real.at(20.0), true.gain.real.at(20.0)
    shape, true_shape = model.gain.at(MODES) / scale, true.gain.at(MODES) / true_scale

    def off(found, expected):
        return np.linalg.norm(found - expected) / np.linalg.norm(expected)

    return {
        "centre": np.linalg.norm(model.centre - true.centre),
        "mass": abs(model.mass / true.mass - 1),
        "inertia": off(model.inertia, true.inertia),
        "stiffness": off(weight * scale * model.stiffness, weight * true_scale * true.stiffness),
        "real": np.max(np.abs(shape.real / true_shape.real - 1)),
        "imaginary": np.max(np.abs(shape.imag / true_shape.imag - 1)),
    }


def test_exact_files_return_the_exact_compressor(tmp_path):
    """No noise, no placement errors: what is left is rounding of files and of the optimiser."""
    plan = CompressorPlan(CompressorCase.TABLE11)
    folder = write_compressor_test(tmp_path / "test", plan=plan, noise_free=True)
    found = identify(read_inertance_test(folder), IdentifyOptions(largest_lines=16))
    true = read_compressor_truth(folder).model
    for name, error in errors(found.point.model, true).items():
        assert error < 1e-5, name
    np.testing.assert_allclose(found.point.model.mass_matrix, true.mass_matrix, atol=1e-5)


OPTIONS = IdentifyOptions(largest_lines=36)


@pytest.fixture(scope="module")
def found(tmp_path_factory):
    """Identify a compressor on identical mounts once; the truth beside it."""
    folder = tmp_path_factory.mktemp("bench") / "test"
    plan = CompressorPlan(identical_mounts=True)
    write_compressor_test(folder, 4, CalibrationLevel.C05, plan)
    test = read_inertance_test(folder)
    return identify(test, OPTIONS), read_compressor_truth(folder)


@pytest.fixture(scope="module")
def thesis(found):
    return fit_thesis_parameters(found[0], found[0].test.drawing)


def test_identification_returns_the_truth_within_the_figures(found):
    identified, truth = found
    assert identified.alarms == ()
    off = errors(identified.calibrated.model, truth.model)
    figures = {"mass": 0.002, "centre": 0.4e-3, "inertia": 0.006, "stiffness": 0.006}
    for name, figure in (figures | {"real": 0.001, "imaginary": 0.002}).items():
        assert off[name] < SLACK * figure, name
    # self-calibration, not luck: the virtual point with the sheet's placement is worse
    assert off["inertia"] < errors(identified.point.model, truth.model)["inertia"]


def test_quantities_are_as_sure_as_they_state(found):
    identified, truth = found
    error = quantities(identified.calibrated.model).values - quantities(truth.model).values
    scores = error / quantity_deviations(identified.calibrated)
    assert np.sqrt(np.mean(scores**2)) < 2.0
    stated = quantity_deviations(identified.calibrated)
    mass = identified.calibrated.model.mass
    # mass = exp(2 value), so its deviation is 2 mass times that of the parameter
    own = np.sqrt(identified.calibrated.parameter_covariance[0, 0])
    assert stated[0] == pytest.approx(2 * mass * own, rel=1e-5)


def test_the_gain_is_sure_where_it_is_one_by_definition(found):
    deviation = gain_deviation(found[0].calibrated, [10.0, 20.0, 30.0])
    assert deviation.real[1] < 1e-9
    assert deviation.real[0] > 1e-6


def test_nine_of_the_44_numbers_stay_hidden(found, thesis):
    assert thesis.seen.rank == 35
    alone = [line.statement for line in thesis.seen.null_space if len(line.names) == 1]
    assert "mount 1 rotation x is not visible" in alone
    assert thesis.seen.participation[thesis.seen.names.index("mount 1 rotation x")] > 0.9
    body = [name.startswith(("I", "centre", "mass")) for name in thesis.seen.names]
    assert thesis.known.ratio[body].max() < 0.15
    turned = thesis.seen.names.index("mount 2 rotation x")
    assert thesis.known.ratio[turned] > 0.9
    assert np.all(thesis.known.ratio <= 1)


def test_start_and_bounds_are_the_corrected_ones(found):
    drawing = found[0].test.drawing
    parametrisation, start = thesis_start(drawing)
    bounds = thesis_bounds(drawing, start)
    half = dict(zip(parametrisation.names, (bounds.upper - bounds.lower) / 2, strict=True))
    assert half["mount 1 position x"] == pytest.approx(12.6e-3)
    assert half["mount 1 rotation x"] == pytest.approx(np.radians(5))
    assert half["mount 1 stiffness axial"] == pytest.approx(0.35 * 23e3)
    assert half["Ixx"] == pytest.approx(0.1 * 0.015)
    assert half["Ixy"] == pytest.approx(5e-4)
    assert half["centre x"] == pytest.approx(3e-3)
    assert half["mass"] == pytest.approx(0.5)


def test_identical_mounts_are_found_one_by_one(found):
    identified, truth = found
    fit = mount_shares(identified, identified.test.drawing.mounts, identical=True)
    assert fit.identical_holds
    for mount, true in zip(fit.mounts, truth.mounts, strict=True):
        assert np.linalg.norm(mount.position - true.position) < 1.5e-3
        along = mount.orientation[:, 0] @ true.orientation[:, 0]
        assert abs(along) > np.cos(np.radians(1.0))
    true = truth.mounts[0].stiffness[:2] * truth.model.gain.real.at(20.0)
    assert fit.mounts[0].stiffness[:2] == pytest.approx(true, rel=0.02)


def test_modes_and_frfs_of_one_compressor_are_alike(found):
    identified, _ = found
    likeness = modal_likeness(identified)
    assert np.diag(likeness).min() > 0.98
    lines = identified.inertance.frequency
    model = identified.calibrated.model.inertance(lines)
    assert frac(model, 2j * model, lines, (10.0, 30.0)) == pytest.approx(1.0)
    calibrated = identified.calibrated
    response = np.linalg.pinv(calibrated.response_matrix)
    excitation = np.linalg.pinv(calibrated.excitation_matrix)
    measured = response @ identified.raw.frf.values @ excitation.T
    assert np.diag(frac(measured, model, lines, (10.0, 30.0))).min() > 0.999


def test_what_is_kept_rebuilds_the_raw_frfs(found):
    identified, _ = found
    kept = compressor_document(identified, {})
    model = CompressorModel(
        kept["mass_kg"],
        kept["centre_of_gravity_m"],
        kept["inertia_about_centre_kg_m2"],
        kept["stiffness_at_virtual_point"],
        GainFactor.of([*kept["gain"].values()]),
    )
    response, excitation = (np.array(kept[of]["matrix"]) for of in ("response", "excitation"))
    lines = identified.raw.frf.frequency
    predicted = response @ model.inertance(lines) @ excitation.T
    misfit = np.abs(predicted - identified.raw.frf.values) / identified.raw.deviation
    assert np.sqrt(np.mean(misfit**2) / 2) < 1.2


def test_a_truth_that_is_none(tmp_path):
    with pytest.raises(InputError, match="leave out --truth"):
        read_compressor_truth(tmp_path)
    (tmp_path / TRUTH_FILE).parent.mkdir()
    (tmp_path / TRUTH_FILE).write_text("{}", encoding="utf-8")
    with pytest.raises(InputError, match="not the truth"):
        read_compressor_truth(tmp_path)
