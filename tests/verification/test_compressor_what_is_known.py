"""What a test says of the thesis's numbers, of identical mounts, of quantities: against the truth.

Two virtual compressors of the bench, well calibrated, with few lines.
"""

import numpy as np
import pytest

from deboom.bench.compressor_plan import CalibrationLevel, CompressorPlan
from deboom.bench.compressor_writer import write_compressor_test
from deboom.compressor.identical_fit import fit_identical_mounts
from deboom.compressor.identified import identified_compressor
from deboom.compressor.identify import IdentifyOptions, identify
from deboom.compressor.likeness import frac, modal_likeness
from deboom.compressor.quantities import gain_deviation, quantity_deviations
from deboom.compressor.thesis_fit import fit_thesis_parameters, thesis_bounds, thesis_start
from deboom.errors import InputError
from deboom.files.inertance_test import read_inertance_test
from deboom.study.compressor_identification_truth import (
    TRUTH_FILE,
    errors_of,
    mounting_errors,
    quantity_scores,
    read_compressor_truth,
)

OPTIONS = IdentifyOptions(largest_lines=36, held_out=0)


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


def test_quantities_are_as_sure_as_they_state(found):
    identified, truth = found
    scores = quantity_scores(identified, truth)
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
    error = errors_of(*found)
    assert error.gain_real < 1e-3
    assert error.gain_imaginary < 2e-3


def test_nine_of_the_44_numbers_stay_hidden(found, thesis):
    assert thesis.seen.rank == 35
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
    fit = fit_identical_mounts(identified, identified.test.drawing)
    assert fit.holds
    place, angle = mounting_errors(fit, truth)
    assert place < 1.5e-3
    assert np.degrees(angle) < 1.0
    true = truth.mounts[0].stiffness[:2] * truth.model.gain.real.at(20.0)
    assert fit.mounts[0].stiffness[:2] == pytest.approx(true, rel=0.02)


def test_modes_and_frfs_of_one_compressor_are_alike(found):
    identified, _ = found
    likeness = modal_likeness(identified)
    assert np.diag(likeness).min() > 0.98
    lines = identified.inertance.frequency
    model = identified.calibrated.model.inertance(lines)
    assert frac(model, 2j * model, lines, (10.0, 30.0)) == pytest.approx(1.0)
    measured = identified.calibrated.at_virtual_point(identified.raw.frf.values)
    assert np.diag(frac(measured, model, lines, (10.0, 30.0))).min() > 0.999


def test_what_is_kept_rebuilds_the_raw_frfs(found):
    identified, _ = found
    kept = identified_compressor(identified, OPTIONS.bands, {})
    lines = identified.raw.frf.frequency
    predicted = kept.response @ kept.model.inertance(lines) @ kept.excitation.T
    misfit = np.abs(predicted - identified.raw.frf.values) / identified.raw.deviation
    assert np.sqrt(np.mean(misfit**2) / 2) < 1.2


def test_a_truth_that_is_none(tmp_path):
    assert read_compressor_truth(tmp_path) is None
    (tmp_path / TRUTH_FILE).parent.mkdir()
    (tmp_path / TRUTH_FILE).write_text("{}", encoding="utf-8")
    with pytest.raises(InputError, match="not the truth"):
        read_compressor_truth(tmp_path)
