"""Poles, clusters and shapes: what is kept, what is dropped, what is refused."""

import sys

import numpy as np
import pytest

from deboom.errors import InputError
from deboom.measurement import modal
from deboom.measurement.channels import Frf
from deboom.physics.frf import FrfForm

BAND = (20.0, 60.0)
RECEPTANCE = FrfForm.RECEPTANCE


def pole(frequency, damping):
    omega = 2 * np.pi * frequency
    return complex(-damping * omega, omega * np.sqrt(1 - damping**2))


def frf_of(poles, frequency, form_power=0):
    w = 2 * np.pi * frequency[:, None]
    values = sum(
        (k + 1) / (1j * w - s) + (k + 1) / (1j * w - np.conj(s)) for k, s in enumerate(poles)
    )
    values = values * (1j * w) ** form_power
    return Frf(frequency, values[:, :, None], ("out",), ("in",), "m/N")


TWO = [pole(30.0, 0.02), pole(41.0, 0.03)]
LINES = np.arange(0.25, 65.01, 0.25)


def test_what_a_structure_cannot_have_is_dropped():
    good = pole(30.0, 0.02)
    chart = modal.stabilisation_chart(
        {
            4: np.array([0j, good, np.conj(good), pole(10.0, 0.02), pole(70.0, 0.02)]),
            5: np.array([good, good * (1 + 1e-9), pole(40.0, 0.5), -np.conj(pole(45.0, 0.02))]),
        },
        BAND,
    )
    assert chart.order.tolist() == [4, 5]
    assert chart.frequency == pytest.approx([30.0, 30.0])
    assert chart.damping == pytest.approx([0.02, 0.02])
    assert chart.stable.tolist() == [False, True]
    assert chart.orders == (4, 5)


def test_limits_decide_what_is_stable():
    poles = {4: np.array([pole(30.0, 0.02)]), 5: np.array([pole(30.6, 0.02)])}
    assert modal.stabilisation_chart(poles, BAND).stable.tolist() == [False, False]
    poles[5] = np.array([pole(30.2, 0.022)])
    assert modal.stabilisation_chart(poles, BAND).stable.tolist() == [False, True]
    poles[5] = np.array([pole(30.2, 0.03)])
    assert modal.stabilisation_chart(poles, BAND).stable.tolist() == [False, False]


def test_clusters_carry_the_spread_over_the_orders():
    frequencies = [30.0, 30.03, 29.97, 30.06]
    dampings = [0.02, 0.021, 0.0205, 0.02]
    by_order = {
        4 + k: np.array([pole(f, z)])
        for k, (f, z) in enumerate(zip(frequencies, dampings, strict=True))
    }
    (cluster,) = modal.pole_clusters(modal.stabilisation_chart(by_order, BAND))
    assert cluster.frequency == pytest.approx(np.median(frequencies[1:]))
    assert cluster.frequency_spread == pytest.approx(np.std(frequencies[1:]))
    assert cluster.damping_spread == pytest.approx(np.std(dampings[1:]))
    assert cluster.share == pytest.approx(3 / 4)
    assert cluster.pole == pytest.approx(pole(cluster.frequency, cluster.damping))


def test_modes_closer_than_the_width_stay_two():
    """A chain of poles 0.6 % apart: one order has both, so they are two modes."""
    pair = np.array([pole(30.0, 0.02), pole(30.2, 0.021)])
    by_order = {order: pair * (1 + 1e-4 * (order % 2)) for order in range(4, 12)}
    clusters = modal.pole_clusters(modal.stabilisation_chart(by_order, BAND), width=0.01)
    assert [round(cluster.frequency, 1) for cluster in clusters] == [30.0, 30.2]
    assert all(cluster.share == 7 / 8 for cluster in clusters)


def test_no_stable_pole_is_said():
    by_order = {k: np.array([pole(25.0 + 3 * (k % 5), 0.02)]) for k in range(4, 12)}
    with pytest.raises(InputError, match="no pole between 20 and 60 Hz is stable over 25 %"):
        modal.pole_clusters(modal.stabilisation_chart(by_order, BAND))


def test_mac_matrix_and_collinearity():
    real = np.array([[1.0, 2.0, -1.0], [0.5, 0.0, 2.0]])
    turned = real * np.exp(1j * np.array([[0.4], [2.0]]))
    assert np.diag(modal.mac_matrix(real, turned)) == pytest.approx(1.0)
    assert modal.mac_matrix(real, turned[:1]).shape == (2, 1)
    assert modal.phase_collinearity(turned) == pytest.approx(1.0)
    assert modal.phase_collinearity(np.array([1.0, 1j])) == pytest.approx(0.0)
    common = modal.in_common_phase(turned)
    assert common == pytest.approx(real / np.array([[2.0], [2.0]]), abs=1e-12)
    with pytest.raises(InputError, match="3 and of 2 outputs"):
        modal.mac_matrix(real, real[:, :2])


@pytest.mark.parametrize(
    ("frf", "form", "band", "order", "sentence"),
    [
        (frf_of(TWO, LINES), FrfForm.APPARENT_MASS, BAND, 8, "not apparent mass: convert"),
        (frf_of(TWO, LINES**1.01), RECEPTANCE, BAND, 8, "needs equidistant lines"),
        (frf_of(TWO, LINES + 0.1), RECEPTANCE, BAND, 8, "whole multiples of their step"),
        (frf_of(TWO, LINES), RECEPTANCE, (20.0, 90.0), 8, "does not lie within the lines, 0.25-65"),
        (frf_of(TWO, LINES), RECEPTANCE, (0.0, 60.0), 8, "begins above 0 Hz"),
        (frf_of(TWO, LINES), RECEPTANCE, (60.0, 20.0), 8, "begins above 0 Hz and ends later"),
        (frf_of(TWO, LINES), RECEPTANCE, (30.0, 32.0), 8, "9 lines between 30 and 32 Hz do not"),
        (frf_of(TWO, LINES), RECEPTANCE, (40.1, 40.2), 8, "there is no line between 40.1 and 40.2"),
        (frf_of(TWO, LINES), RECEPTANCE, (55.0, 60.0), 10, "does not carry a polynomial of order"),
        (frf_of(TWO, LINES), RECEPTANCE, (57.0, 60.0), None, "carries no polynomial above order 4"),
    ],
)
def test_bad_input_is_refused(frf, form, band, order, sentence):
    pytest.importorskip("sdypy.EMA")
    with pytest.raises(InputError, match=sentence):
        modal.poles_over_orders(frf, form, band, largest_order=order)


def test_a_line_at_0_hz_does_no_harm():
    pytest.importorskip("sdypy.EMA")
    with_zero = frf_of(TWO, np.arange(0.0, 65.01, 0.25))
    clusters = modal.pole_clusters(
        modal.poles_over_orders(with_zero, RECEPTANCE, BAND, largest_order=8)
    )
    assert [round(cluster.frequency, 2) for cluster in clusters] == [30.0, 41.0]
    model = modal.modal_model(with_zero, RECEPTANCE, BAND, clusters)
    assert model.residues[:, 0, 0] == pytest.approx([1.0, 2.0], rel=1e-3)


def test_modes_that_cannot_be_told_apart_are_refused():
    pytest.importorskip("sdypy.EMA")
    frf = frf_of(TWO, LINES)
    mode = modal.PoleCluster(30.0, 0.0, 0.02, 0.0, 1.0)
    with pytest.raises(InputError, match=r"two modes share the pole at 30\.00 Hz"):
        modal.modal_model(frf, RECEPTANCE, BAND, [mode, mode])
    with pytest.raises(InputError, match="at least one mode"):
        modal.modal_model(frf, RECEPTANCE, BAND, [])


def test_a_missing_mode_shows_in_the_rebuilt_frf():
    pytest.importorskip("sdypy.EMA")
    frf = frf_of(TWO, LINES)
    clusters = modal.pole_clusters(modal.poles_over_orders(frf, RECEPTANCE, BAND, largest_order=8))
    whole = modal.modal_model(frf, RECEPTANCE, BAND, clusters)
    assert whole.verdict.endswith("of the FRFs unexplained.")
    partly = modal.modal_model(frf, RECEPTANCE, BAND, clusters[:1])
    assert partly.total_error > 0.3
    assert "a mode is missing" in partly.verdict


def noisy_bodies(frequencies, lines, noise):
    """Accelerance of modes with 1 % damping and drawn shapes at 12 sensors, two hammers."""
    random = np.random.default_rng(1)
    shapes, participations = (random.normal(size=(len(frequencies), n)) for n in (12, 2))
    s, omega = 2j * np.pi * lines[:, np.newaxis], 2 * np.pi * np.array(frequencies)
    modes = s**2 / (omega**2 + 0.02 * omega * s + s**2)
    values = np.einsum("fm,mo,mi->foi", modes, shapes, participations)
    size = noise * np.sqrt(np.mean(np.abs(values) ** 2, axis=0) / 2)
    real, imaginary = random.normal(size=(2, *values.shape))
    values = values + size * (real + 1j * imaginary)
    names = tuple(f"o{k}" for k in range(12))
    return Frf(lines, values, names, ("left", "right"), "(m/s^2)/N")


def test_a_band_of_six_octaves_keeps_its_low_modes():
    pytest.importorskip("sdypy.EMA")
    true = [7.0, 11.0, 17.5, 26.0, 41.0, 63.0, 80.0, 101.0, 133.0, 160.0, 190.0, 222.0, 250.0]
    true += [281.0, 310.0, 340.0, 365.0]
    frf = noisy_bodies(true, np.arange(0.25, 400.0, 0.25), 0.01)
    clusters = modal.pole_clusters(modal.poles_over_orders(frf, FrfForm.INERTANCE, (5.0, 380.0)))
    np.testing.assert_allclose([c.frequency for c in clusters], true, rtol=5e-3)


@pytest.mark.parametrize(
    ("other", "noise", "n_close"), [(30.8, 0.02, 2), (30.2, 0.001, 2), (30.5, 0.02, 1)]
)
def test_two_close_modes_are_told_apart_or_named(other, noise, n_close):
    pytest.importorskip("sdypy.EMA")
    frf = noisy_bodies([18.0, 24.0, 30.0, other, 45.0, 80.0], np.arange(0.25, 150.0, 0.25), noise)
    band = (15.0, 140.0)
    clusters = modal.pole_clusters(modal.poles_over_orders(frf, FrfForm.INERTANCE, band))
    model = modal.modal_model(frf, FrfForm.INERTANCE, band, clusters)
    close = np.abs(model.frequency - 30.2) < 2
    assert close.sum() == n_close
    assert (model.nearby_error[close].max() > modal.LARGE_NEARBY) == (n_close == 1)
    assert ("two modes stand as one" in model.verdict) == (n_close == 1)


def test_without_the_library_the_extra_is_named(monkeypatch):
    monkeypatch.setitem(sys.modules, "sdypy", None)
    with pytest.raises(InputError, match='the extra "modal"'):
        modal.poles_over_orders(frf_of(TWO, LINES), RECEPTANCE, BAND, largest_order=8)


def through_hann(frequency, damping, step):
    """One mode as random excitation and Hann windows of 1/step seconds show it on their lines."""
    fine, first = step / 16, 5.0
    lines = np.arange(first - 3 * step, 60 + 3 * step, fine)
    exact = frf_of([pole(frequency, damping)], lines).values[:, 0, 0]
    x = np.arange(-3, 3 + 1 / 32, 1 / 16)
    hann = np.sinc(x) + 0.5 * np.sinc(x - 1) + 0.5 * np.sinc(x + 1)
    smooth = np.convolve(exact, hann**2 / np.sum(hann**2), mode="same")
    kept = np.round(lines / fine).astype(int) % 16 == 0
    kept &= (lines > first - step / 2) & (lines < 60.5)
    return Frf(lines[kept], smooth[kept, None, None], ("out",), ("in",), "m/N")


@pytest.mark.parametrize(("damping", "step", "is_resolution"), [(0.005, 1.0, 1), (0.02, 0.125, 0)])
def test_a_mode_as_narrow_as_the_window_is_resolution_not_damping(damping, step, is_resolution):
    """One mode of 0.5 % stood as three of 3.0 to 3.6 %, with 0.5 % left unexplained."""
    pytest.importorskip("sdypy.EMA")
    frf = through_hann(20.0, damping, step)
    chart = modal.poles_over_orders(frf, RECEPTANCE, (10.0, 40.0))
    model = modal.modal_model(frf, RECEPTANCE, (10.0, 40.0), modal.pole_clusters(chart))
    assert ("resolution, not damping" in model.verdict) == is_resolution
    wide = np.abs(model.damping / damping - 1) > 0.5
    assert wide.any() == is_resolution
    assert np.all(model.lines_per_width[wide] < modal.FEWEST_LINES)
