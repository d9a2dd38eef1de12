"""Identification against known truth."""

import json

import numpy as np
import pytest

from deboom.bench.choices import CalibrationLevel, CompressorCase
from deboom.bench.compressor_truth import CompressorPlan
from deboom.bench.compressor_writer import write_compressor_test
from deboom.compressor.hammer_identification import frac, identify, modal_likeness
from deboom.compressor.identification_results import errors_of
from deboom.compressor.identified_compressor import IdentifyOptions
from deboom.compressor.inertance_fit import (
    Bounds,
    fit_at_virtual_point,
    in_bands,
    inertance_and_apparent_mass,
    linear_start,
)
from deboom.compressor.model import GAIN_PARAMETERS, CompressorModel, GainFactor
from deboom.compressor.mount_shares import mount_shares
from deboom.compressor.parameter_information import (
    gain_deviation,
    identifiability,
    quantities,
    quantity_deviations,
)
from deboom.compressor.parameters import MinimalParameters
from deboom.compressor.self_calibration import deviation_from_coherence
from deboom.compressor.thesis_parameter_fit import (
    fit_thesis_parameters,
    thesis_bounds,
    thesis_start,
)
from deboom.errors import InputError
from deboom.files.compressor_model import compressor_document
from deboom.files.inertance_test import read_inertance_test
from deboom.files.truth import TRUTH_FILE, read_compressor_truth
from deboom.measurement.channels import Frf


def test_deviation_from_the_coherence_of_five_hits():
    rng = np.random.default_rng(7)
    shape, hits, noise = (200, 18, 6), 5, 0.05
    true = np.full(shape, 1.0 + 0.5j)
    force = np.ones((hits, *shape))
    response = true * force + noise * (
        rng.standard_normal((hits, *shape)) + 1j * rng.standard_normal((hits, *shape))
    )
    cross, auto = response.mean(axis=0), (np.abs(response) ** 2).mean(axis=0)
    names = [f"{i}" for i in range(18)]
    frf = Frf(np.arange(1.0, 201.0), cross, names, names[:6], "1/kg")
    deviation = deviation_from_coherence(frf, np.abs(cross) ** 2 / auto, hits)
    np.testing.assert_allclose(deviation, noise / np.sqrt(hits), rtol=0.12)
    assert np.median(deviation) == pytest.approx(noise / np.sqrt(hits), rel=0.02)


@pytest.mark.parametrize(
    ("build", "words"),
    [
        (lambda frf: deviation_from_coherence(frf, np.ones(frf.values.shape), 1), "one hit"),
        (lambda frf: in_bands(frf.frequency, ((200.0, 300.0),)), "no line"),
        (
            lambda frf: linear_start(MinimalParameters(0.055), frf.frequency, -frf.values),
            "wrong sign",
        ),
        (lambda _: identifiability(("a", "b"), np.ones((1, 2)), np.ones(2)), "cannot fix"),
    ],
)
def test_what_no_fit_may_swallow(build, words, identified_and_truth):
    with pytest.raises(InputError, match=words):
        build(identified_and_truth[0].inertance)


def test_a_fit_from_outside_its_bounds_is_refused(thesis):
    objective = inertance_and_apparent_mass(np.array([10.0]), np.eye(6)[None] + 0j, 0.055)
    bounds = Bounds(thesis.bounds.lower + 1, thesis.bounds.upper + 1)
    with pytest.raises(InputError, match="outside its bounds"):
        fit_at_virtual_point(thesis.fit.parametrisation, objective, thesis.start, bounds)


SLACK = 1.5
"""One compressor against a figure that 90 % of compressors meet."""
MODES = np.arange(10.0, 30.5, 0.5)
SCALE = np.repeat([1.0, 1 / 0.055], 3)


def errors(model, true):
    """Centre [m], and relative errors of mass, inertia, dynamic stiffness at 20 Hz, gain shape."""
    weight = np.outer(SCALE, SCALE)
    scale, true_scale = model.gain.real.at(20.0), true.gain.real.at(20.0)
    shape, true_shape = model.gain.at(MODES) / scale, true.gain.at(MODES) / true_scale

    def off(estimated, expected):
        return np.linalg.norm(estimated - expected) / np.linalg.norm(expected)

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
    exact = identify(read_inertance_test(folder), IdentifyOptions(largest_lines=16))
    true = read_compressor_truth(folder).model
    for name, error in errors(exact.point.model, true).items():
        assert error < 1e-5, name
    np.testing.assert_allclose(exact.point.model.mass_matrix, true.mass_matrix, atol=1e-5)


OPTIONS = IdentifyOptions(largest_lines=36)


@pytest.fixture(scope="module")
def identified_and_truth(tmp_path_factory):
    """Identify a compressor on identical mounts once; the truth beside it."""
    folder = tmp_path_factory.mktemp("bench") / "test"
    plan = CompressorPlan(identical_mounts=True)
    write_compressor_test(folder, 4, CalibrationLevel.C05, plan)
    return identify(read_inertance_test(folder), OPTIONS), read_compressor_truth(folder)


@pytest.fixture(scope="module")
def thesis(identified_and_truth):
    return fit_thesis_parameters(identified_and_truth[0], identified_and_truth[0].test.drawing)


def test_identification_returns_the_truth_within_the_figures(identified_and_truth):
    identified, truth = identified_and_truth
    assert identified.alarms == ()
    off = errors(identified.calibrated.model, truth.model)
    figures = {"mass": 0.002, "centre": 0.4e-3, "inertia": 0.006, "stiffness": 0.006}
    for name, figure in (figures | {"real": 0.001, "imaginary": 0.002}).items():
        assert off[name] < SLACK * figure, name
    # self-calibration, not luck: the virtual point with the sheet's placement is worse
    assert off["inertia"] < errors(identified.point.model, truth.model)["inertia"]


def test_the_page_states_the_errors_and_scores_of_a_standard_normal(identified_and_truth):
    identified, truth = identified_and_truth
    stated, off = errors_of(identified, truth), errors(identified.calibrated.model, truth.model)
    assert [stated.mass, stated.centre] == pytest.approx([off["mass"], off["centre"]])
    assert 0.3 < np.sqrt(np.mean(stated.scores**2)) < 2.0


def test_quantities_are_as_sure_as_they_state(identified_and_truth):
    identified, truth = identified_and_truth
    error = quantities(identified.calibrated.model).values - quantities(truth.model).values
    scores = error / quantity_deviations(identified.calibrated)
    assert np.sqrt(np.mean(scores**2)) < 2.0
    stated = quantity_deviations(identified.calibrated)
    mass = identified.calibrated.model.mass
    # mass = exp(2 value), so its deviation is 2 mass times that of the parameter
    deviation = np.sqrt(identified.calibrated.parameter_covariance[0, 0])
    assert stated[0] == pytest.approx(2 * mass * deviation, rel=1e-5)


def test_the_gain_is_sure_where_it_is_one_by_definition(identified_and_truth):
    deviation = gain_deviation(identified_and_truth[0].calibrated, [10.0, 20.0, 30.0])
    assert deviation.real[1] < 1e-9
    assert deviation.real[0] > 1e-6


def test_the_thesis_numbers_are_a_fit_to_the_same_compressor(identified_and_truth, thesis):
    """Single numbers are not unique, but the compressor that they stand for is."""
    model, true = thesis.fit.model, identified_and_truth[1].model
    assert thesis.fit.converged
    assert thesis.fit.cost < 0.01 * start_cost(identified_and_truth[0], thesis)
    for name, figure in {"mass": 0.01, "inertia": 0.05, "stiffness": 0.05}.items():
        assert errors(model, true)[name] < figure, name


def start_cost(identified, thesis):
    """Half the sum of squares where the fit of the thesis began."""
    frf, fitted = identified.inertance, identified.fitted
    lines = frf.frequency[fitted]
    objective = inertance_and_apparent_mass(lines, frf.values[fitted], identified.length)
    begun = thesis.fit.parametrisation.model(thesis.start)
    off = objective.residuals(begun.apparent_mass(lines), begun.inertance(lines))
    return 0.5 * np.sum(np.abs(off) ** 2)


def test_nine_of_the_44_numbers_stay_hidden(identified_and_truth, thesis):
    assert thesis.seen.rank == 35
    alone = [line.statement for line in thesis.seen.null_space if len(line.names) == 1]
    assert "mount 1 rotation x is not visible" in alone
    assert thesis.seen.participation[thesis.seen.names.index("mount 1 rotation x")] > 0.9
    body = [name.startswith(("I", "centre", "mass")) for name in thesis.seen.names]
    assert thesis.knowledge.ratio[body].max() < 0.15
    assert thesis.knowledge.ratio[thesis.seen.names.index("mount 2 rotation x")] > 0.9
    assert np.all(thesis.knowledge.ratio <= 1)


def test_start_and_bounds_are_the_corrected_ones(identified_and_truth):
    drawing = identified_and_truth[0].test.drawing
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


def test_identical_mounts_are_found_one_by_one(identified_and_truth):
    identified, truth = identified_and_truth
    fit = mount_shares(identified, identified.test.drawing.mounts, identical=True)
    assert fit.identical_holds
    for mount, true in zip(fit.mounts, truth.mounts, strict=True):
        assert np.linalg.norm(mount.position - true.position) < 1.5e-3
        along = mount.orientation[:, 0] @ true.orientation[:, 0]
        assert abs(along) > np.cos(np.radians(1.0))
    true = truth.mounts[0].stiffness[:2] * truth.model.gain.real.at(20.0)
    assert fit.mounts[0].stiffness[:2] == pytest.approx(true, rel=0.02)


def test_modes_and_frfs_of_one_compressor_are_alike(identified_and_truth):
    identified, _ = identified_and_truth
    assert np.diag(modal_likeness(identified)).min() > 0.98
    lines = identified.inertance.frequency
    model = identified.calibrated.model.inertance(lines)
    assert frac(model, 2j * model, lines, (10.0, 30.0)) == pytest.approx(1.0)
    calibrated = identified.calibrated
    response = np.linalg.pinv(calibrated.response_matrix)
    excitation = np.linalg.pinv(calibrated.excitation_matrix)
    measured = response @ identified.raw.frf.values @ excitation.T
    assert np.diag(frac(measured, model, lines, (10.0, 30.0))).min() > 0.999


def test_what_is_kept_rebuilds_the_raw_frfs(identified_and_truth):
    identified, _ = identified_and_truth
    kept = json.loads(json.dumps(compressor_document(identified, {})))
    model = CompressorModel(
        mass=kept["mass_kg"],
        centre=np.array(kept["centre_of_gravity_m"]),
        inertia=np.array(kept["inertia_about_centre_kg_m2"]),
        stiffness=np.array(kept["stiffness_at_virtual_point"]),
        gain=GainFactor.of([kept["gain"][name] for name in GAIN_PARAMETERS]),
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
