"""Modal table, rigid limit, exchanged channels: closed forms and direct searches."""

import numpy as np
import pytest
from scipy.optimize import brentq

from deboom.compressor.gain import GainFactor
from deboom.compressor.model import CompressorModel
from deboom.compressor.modes import MOTIONS, modal_table
from deboom.compressor.rigid_limit import rigid_limit
from deboom.errors import InputError
from deboom.measurement.channel_geometry import impact_geometry
from deboom.measurement.channels import Frf
from deboom.measurement.exchanged import exchanged_impacts
from deboom.measurement.impacts import Impact
from deboom.measurement.inertance_test import CompressorMount
from deboom.measurement.virtual_point import virtual_point

RUBBER = [1.85, 0.06, 2.2, 0.42, 0.15, 2.5]
INERTIA = np.array([[0.0158, 2e-4, -1.5e-4], [2e-4, 0.0291, 1e-4], [-1.5e-4, 1e-4, 0.0302]])
PLACES = np.array([[-0.156, 0.004, 0.020], [-0.019, -0.067, 0.078], [-0.008, 0.074, 0.082]])
TURNS = np.deg2rad([[-4.9, -4.9, 185.0], [2.5, 43.3, 87.5], [2.2, 131.5, 89.4]])


def compressor(gain=RUBBER):
    mounts = [
        CompressorMount("mount", place, turn, np.array([29e3, 11e3, 11e3]))
        for place, turn in zip(PLACES, TURNS, strict=True)
    ]
    centre = np.array([0.0015, -0.002, 0.001])
    return CompressorModel.on_mounts(7.2, centre, INERTIA, mounts, GainFactor.of(gain))


def test_natural_frequencies_are_the_roots_of_the_determinant():
    """det(v'(f) K − ω² M) = 0, by bracketing between the lines; no mode is left out."""
    model = compressor()

    def determinant(f):
        stiffness = model.gain.real.at(f) * model.stiffness
        return np.linalg.slogdet(stiffness - (2 * np.pi * f) ** 2 * model.mass_matrix)

    lines = np.arange(5.0, 40.0, 0.05)
    signs = np.array([determinant(f).sign for f in lines])
    roots = [
        brentq(lambda f: determinant(f).sign * np.exp(determinant(f).logabsdet - 40), a, b)
        for a, b, one, other in zip(lines, lines[1:], signs, signs[1:], strict=False)
        if one != other
    ]
    table = modal_table(model)
    np.testing.assert_allclose(table.frequency, roots, rtol=1e-9)
    gains = model.gain.at(table.frequency)
    np.testing.assert_allclose(table.loss_factor, gains.imag / gains.real, rtol=1e-12)


def test_peaks_of_a_lightly_damped_inertance_lie_at_the_natural_frequencies():
    model = compressor([1.85, 0.06, 2.2, 0.008, 1e3, 1e3])
    lines = np.arange(8.0, 36.0, 0.01)
    scale = np.repeat([1.0, 1 / 0.055], 3)
    receptance = model.inertance(lines) / (2 * np.pi * lines[:, None, None]) ** 2
    size = np.linalg.norm(receptance * np.outer(1 / scale, 1 / scale), axis=(1, 2))
    peaks = lines[1:-1][(size[1:-1] > size[:-2]) & (size[1:-1] > size[2:])]
    table = modal_table(model)
    np.testing.assert_allclose(peaks, table.frequency, rtol=2e-3)


def test_shapes_and_shares_of_a_body_on_a_mount_at_its_centre():
    """Translations along the mount's axes; energy shares add up to 1; the largest names them."""
    stiffness = np.diag([9e4, 4e4, 1e4, 100.0, 400.0, 900.0])
    model = CompressorModel(
        10.0, np.zeros(3), np.diag([0.02, 0.02, 0.02]), stiffness, GainFactor.of(RUBBER)
    )
    table = modal_table(model)
    static = np.sqrt(np.diag(stiffness) / np.diag(model.mass_matrix)) / (2 * np.pi)
    for number, motion in enumerate(table.leading):
        axis = MOTIONS.index(motion)
        f = table.frequency[number]
        assert f == pytest.approx(static[axis] * np.sqrt(1.85 - 1 / (0.06 * f + 2.2)), rel=1e-10)
    assert sorted(table.leading) == sorted(MOTIONS)
    np.testing.assert_allclose(table.energy.sum(axis=0), 1, rtol=1e-12)
    coupled = modal_table(compressor())
    np.testing.assert_allclose(coupled.energy.sum(axis=0), 1, rtol=1e-9)
    product = coupled.shapes.T @ compressor().mass_matrix @ coupled.shapes
    np.testing.assert_allclose(product, np.eye(6), atol=1e-10)


def test_bodies_without_modes_are_refused():
    with pytest.raises(InputError, match="not positive at a natural frequency"):
        modal_table(compressor([0.1, 0.06, 2.2, 0.42, 0.15, 2.5]))
    unstable = CompressorModel(
        7.2, np.zeros(3), INERTIA, np.diag([1e4, 1e4, -1e4, 1, 1, 1]), GainFactor.of(RUBBER)
    )
    with pytest.raises(InputError, match="negative direction"):
        modal_table(unstable)


LINES = np.arange(10.0, 150.5, 0.5)


def drifting(model, pattern, resonance, rng=None, noise=0.0):
    """Apparent mass whose mass line grows towards a resonance of the body."""
    share = (LINES / resonance) ** 2
    growth = (share / (1 - share))[:, None, None] * pattern
    apparent = model.apparent_mass(LINES) + growth
    if rng is not None:
        scale = np.repeat([1.0, 0.055], 3)
        apparent = apparent + noise * np.outer(scale, scale) * rng.standard_normal(apparent.shape)
    return apparent


@pytest.mark.parametrize("resonance", [200.0, 300.0, 500.0])
@pytest.mark.parametrize("where", ["diagonal", "coupling"])
def test_the_limit_is_where_the_drift_reaches_the_tolerance(resonance, where):
    """On the diagonal as in the coupling, which a trace would not see."""
    model = compressor()
    pattern = np.diag(model.mass_matrix.diagonal())
    if where == "coupling":
        pattern = np.zeros((6, 6))
        pattern[0, 4] = pattern[4, 0] = 7.2 * 0.055
    length = np.sqrt(np.trace(INERTIA) / (3 * 7.2))
    weight = np.outer(np.repeat([1.0, 1 / length], 3), np.repeat([1.0, 1 / length], 3))
    ratio = np.linalg.norm(weight * pattern) / np.linalg.norm(weight * model.mass_matrix)
    found = rigid_limit(model, LINES, drifting(model, pattern, resonance))
    # ratio · x/(1 − x) = 0.03 with x = (f/f_n)²
    expected = resonance * np.sqrt(0.03 / (0.03 + ratio))
    share = (150 / resonance) ** 2
    assert found.drift == pytest.approx(ratio * share / (1 - share), rel=0.02)
    assert found.holds_to == pytest.approx(expected, rel=0.02)
    assert not found.is_rigid
    assert f"holds to {found.holds_to:.0f} Hz" in found.statement


def test_noise_and_small_drift_count_as_rigid():
    model = compressor()
    rng = np.random.default_rng(3)
    noisy = rigid_limit(model, LINES, drifting(model, np.zeros((6, 6)), 1e4, rng, 0.3))
    assert noisy.is_rigid
    assert noisy.deviation > 0
    small = rigid_limit(model, LINES, drifting(model, model.mass_matrix, 1500.0))
    assert small.is_rigid
    assert small.drift == pytest.approx(0.01, abs=0.001)
    assert rigid_limit(
        model, LINES, drifting(model, model.mass_matrix, 1500.0), tolerance=0.005
    ).holds_to == pytest.approx(1500 * np.sqrt(0.005), rel=0.02)
    with pytest.raises(InputError, match="fewer than 8 lines"):
        rigid_limit(model, LINES[:50], model.apparent_mass(LINES[:50]))


def hammered(rng, error=0.0):
    """Impacts on a free body, seen by six channels of unit motion."""
    places, directions = rng.uniform(-0.1, 0.1, (12, 3)), np.tile(np.eye(3), (4, 1))
    impacts = [Impact(f"I{n + 1}", places[n], directions[n]) for n in range(12)]
    true = places + error * rng.standard_normal(places.shape)
    wrenches = np.concatenate([directions, np.cross(true, directions)], axis=1)
    model = compressor()
    values = model.inertance(LINES[::20]) @ wrenches.T
    names = tuple(impact.name for impact in impacts)
    return impacts, Frf(LINES[::20], values, MOTIONS, names, "(m/s^2)/N")


@pytest.mark.parametrize("error", [0.0, 0.003])
def test_exchanged_impacts_are_found_and_nothing_else(error):
    impacts, frf = hammered(np.random.default_rng(5), error)
    point = virtual_point(impact_geometry(impacts))
    assert exchanged_impacts(point, frf) is None
    order = list(range(12))
    order[1], order[7] = 7, 1
    mixed = Frf(frf.frequency, frf.values[:, :, order], frf.outputs, frf.inputs, frf.unit)
    found = exchanged_impacts(point, mixed)
    assert found is not None
    assert {found.first, found.second} == {"I2", "I8"}
    assert found.left < 0.5 * found.disagreement
    assert "I2 and I8 are exchanged" in found.verdict
