"""Modes against closed forms, the bench's vehicles out of their files, and a measured ruler."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from deboom.bench.fleet import (
    NO_SPREAD,
    ear_transfer,
    interface_shapes,
    load_fleet,
    panel_pressure,
    source_motion,
)
from deboom.bench.vehicle_writer import VehicleErrors, write_vehicle
from deboom.errors import InputError
from deboom.files.vehicle import read_vehicle
from deboom.measurement.body_modes import body_modes
from deboom.measurement.channels import Frf
from deboom.measurement.impact_test import HammerMeasurement, HammerOptions, hammer_frf
from deboom.measurement.modal import (
    LARGE_ERROR,
    PoleCluster,
    _parts,
    _pole_fit,
    auxiliary_clusters,
    mac_matrix,
    modal_model,
    pole_clusters,
    poles_over_orders,
    refined_poles,
)
from deboom.pages.modal import append_modes, body_motion
from deboom.physics.frf import FrfForm
from deboom.report import Report
from pinned_pages import hold

pytest.importorskip("sdypy.EMA", reason="modal analysis is an extra")

DATA = Path(__file__).parents[1] / "data"
CASES = ("U06-1", "U06-5", "F45-4")


def chain():
    """Four masses between springs, one end fixed: frequencies, dampings, mass-normalised shapes."""
    n, mass, spring = 4, 2.0, 6e4
    r = np.arange(1, n + 1)
    angle = (2 * r - 1) * np.pi / (2 * n + 1)
    omega = 2 * np.sqrt(spring / mass) * np.sin(angle / 2)
    shapes = np.sin(np.outer(angle, np.arange(1, n + 1)))
    shapes /= np.sqrt(mass * np.sum(shapes**2, axis=1))[:, None]
    return omega, 0.01 + 1e-5 * omega, shapes


def test_parts_of_a_wide_band_overlap_by_an_octave():
    parts, edges = np.array(_parts((1.0, 1000.0), 0.0)), np.geomspace(1.0, 1000.0, 6)
    np.testing.assert_allclose(parts[:, 0], [1.0, *(edges[1:-1] / np.sqrt(2))])
    np.testing.assert_allclose(parts[:, 1], [*(edges[1:-1] * np.sqrt(2)), 1000.0])


def chain_frf(form, frequency, added=0.0):
    omega, damping, shapes = chain()
    s = 2j * np.pi * frequency[:, None] + added
    modal = 1 / (omega**2 + s**2 + 2 * damping * omega * s)
    values = np.einsum("nl,fn,nk->flk", shapes, modal, shapes[:, :2])
    values = values * s[:, :, None] ** form.derivative
    return Frf(frequency, values, tuple("abcd"), ("a", "b"), "any", added)


@pytest.mark.parametrize("added", [0.0, 2.5])
@pytest.mark.parametrize("form", [FrfForm.RECEPTANCE, FrfForm.MOBILITY, FrfForm.INERTANCE])
def test_poles_constants_and_shapes_of_a_chain_of_masses(form, added):
    """With an exponential window of τ = 0.4 s, too: H(jω + 1/τ), whose decay comes off again."""
    omega, damping, shapes = chain()
    frf = chain_frf(form, np.arange(0.25, 80.01, 0.25), added)
    band = (1.0, 80.0)

    clusters = pole_clusters(poles_over_orders(frf, form, band, largest_order=14))
    model = modal_model(frf, form, band, clusters)

    np.testing.assert_allclose(2 * np.pi * model.frequency, omega, rtol=1e-6)
    np.testing.assert_allclose(model.damping, damping, rtol=1e-5)
    assert max(cluster.frequency_spread for cluster in clusters) < 0.01
    constants = (
        np.einsum("nl,nk->nlk", shapes, shapes[:, :2])
        / (2j * omega * np.sqrt(1 - damping**2))[:, None, None]
    )
    error = np.abs(model.residues - constants) / np.abs(constants).max(axis=(1, 2), keepdims=True)
    assert error.max() < 1e-4
    assert np.diag(mac_matrix(model.shapes, shapes)) == pytest.approx(1.0, abs=1e-6)
    assert model.rank_one == pytest.approx(1.0, abs=1e-6)
    assert model.complexity == pytest.approx(0.0, abs=1e-4)
    assert model.total_error < 1e-4
    assert model.added_decay_rate == added
    assert ("2.5 1/s of the exponential window are taken off" in model.verdict) == bool(added)
    assert np.array_equal(model.rebuilt.frequency, frf.frequency[frf.frequency >= 1.0])


@pytest.mark.parametrize("added", [0.0, 2.5])
@pytest.mark.parametrize("form", [FrfForm.RECEPTANCE, FrfForm.MOBILITY, FrfForm.INERTANCE])
def test_refined_poles_of_a_chain_of_masses_are_the_true_ones(form, added):
    omega, damping, _ = chain()
    frf = chain_frf(form, np.arange(0.25, 80.01, 0.25), added)
    rough = [
        PoleCluster(hertz, 0.01, ratio, 0.001, 1.0)
        for hertz, ratio in zip(1.002 * omega / (2 * np.pi), 1.4 * damping, strict=True)
    ]
    clusters, auxiliary = refined_poles(frf, form, (5.0, 80.0), rough[1:], rough[:1])
    poles = [*auxiliary, *clusters]
    assert [2 * np.pi * each.frequency for each in poles] == pytest.approx(omega, rel=1e-8)
    assert [each.damping for each in poles] == pytest.approx(damping, rel=1e-7)


def test_the_slope_of_what_poles_leave_is_that_of_differences():
    """Outside of the basis: Kaufman's part inside of it moves no minimum."""
    omega, damping, _ = chain()
    fit = _pole_fit(chain_frf(FrfForm.MOBILITY, np.arange(5.0, 40.5)), FrfForm.MOBILITY, (5, 40))
    poles = 1.01 * omega * (-2 * damping + 1j)
    linear, basis = fit.linear(poles), fit.linear(poles).basis
    size = 1e-4 * omega
    steps = np.concatenate([size, 1j * size])
    slope = fit._slope(poles, linear, steps)
    for k, step in enumerate(steps):
        moved = np.zeros_like(poles)
        moved[k % poles.size] = step
        ends = [fit.linear(poles + sign * moved).deviation for sign in (0.5, -0.5)]
        difference = (ends[0] - ends[1])[:, :, np.newaxis]
        outside = difference - basis @ (basis.transpose(0, 2, 1) @ difference)
        np.testing.assert_allclose(
            slope[:, k], outside.ravel(), rtol=1e-4, atol=1e-5 * np.abs(outside).max()
        )


def near_modes(seed):
    """Two modes 1.3 Hz apart at 38 Hz among four of 3.5 % damping, 3 % noise of each function."""
    natural, damping = 2 * np.pi * np.array([26.0, 38.0, 39.3, 55.0]), 0.035
    lines = np.arange(20.0, 80.01, 0.25)
    s = 2j * np.pi * lines[:, np.newaxis]
    draw = np.random.default_rng(seed)
    shapes = draw.normal(size=(4, 20))
    exact = (shapes[:, 0] / (natural**2 + 2 * damping * natural * s + s**2)) @ shapes
    noise = draw.normal(size=(2, *exact.shape)) / np.sqrt(2)
    values = exact * (1 + 0.03 * (noise[0] + 1j * noise[1]))
    outputs = tuple(f"point {number}" for number in range(20))
    return Frf(lines, values[:, :, np.newaxis], outputs, ("hammer",), "m/N")


def test_maximum_likelihood_takes_the_bias_off_the_damping_of_near_modes():
    form, band, damping = FrfForm.RECEPTANCE, (20.0, 80.0), 0.035
    errors = []
    for seed in range(1, 11):
        frf = near_modes(seed)
        before = pole_clusters(poles_over_orders(frf, form, band, largest_order=20))
        if len(before) != 4:  # a mode more or less is not what refining mends
            continue
        after, _ = refined_poles(frf, form, band, before)
        errors.append([[each.damping / damping - 1 for each in part] for part in (before, after)])
    assert len(errors) >= 5
    of_orders, refined = np.sqrt(np.mean(np.square(errors), axis=(0, 2)))
    assert refined < 0.02
    assert refined < of_orders / 3


@pytest.mark.parametrize("seed", [6, 8])
def test_a_mode_that_noise_made_is_left_out(seed):
    """High orders agree on a pole of 0.3 to 0.7 % near 20 Hz, where there is none."""
    frf, band, true = near_modes(seed), (20.0, 80.0), pytest.approx([26.0, 38.0, 39.3, 55.0], 2e-3)
    before = pole_clusters(poles_over_orders(frf, FrfForm.RECEPTANCE, band))
    assert before[0].frequency < 21
    assert before[0].damping < 0.01
    after, _ = refined_poles(frf, FrfForm.RECEPTANCE, band, before)
    assert [each.frequency for each in after] == true
    real, imaginary = np.random.default_rng(seed).normal(size=(2, *frf.values.shape))
    noise = replace(frf, values=real + 1j * imaginary)
    with pytest.raises(InputError, match="no mode between 20 and 80 Hz stands out of the noise"):
        refined_poles(noise, FrfForm.RECEPTANCE, band, after)


def test_a_mode_that_leaves_the_band_in_the_fit_is_an_auxiliary_one():
    omega, _, _ = chain()
    frf = chain_frf(FrfForm.RECEPTANCE, np.arange(0.25, 80.01, 0.25))
    hertz = omega / (2 * np.pi)
    rough = [PoleCluster(each, 0.01, 0.02, 0.001, 1.0) for each in [hertz[0] + 0.2, *hertz[1:]]]
    clusters, auxiliary = refined_poles(frf, FrfForm.RECEPTANCE, (hertz[0] + 0.1, 80.0), rough)
    assert [each.frequency for each in clusters] == pytest.approx(hertz[1:], rel=1e-6)
    assert [each.frequency for each in auxiliary] == pytest.approx(hertz[:1], rel=1e-6)


def test_a_pole_that_no_mode_stands_for_is_left_out_and_of_two_poles_one():
    omega, damping, _ = chain()
    frf, band = chain_frf(FrfForm.RECEPTANCE, np.arange(0.25, 20.01, 0.25)), (5.0, 20.0)
    hertz = omega[0] / (2 * np.pi)

    def given(*frequencies):
        return tuple(PoleCluster(each, 0.01, 0.01, 0.001, 1.0) for each in frequencies)

    for several in (given(9.4, hertz), given(hertz - 0.003, hertz + 0.005)):
        (mode,) = refined_poles(frf, FrfForm.RECEPTANCE, band, several)[0]
        assert mode.frequency == pytest.approx(hertz, rel=1e-4)
        assert mode.damping == pytest.approx(damping[0], rel=0.01)
    with pytest.raises(InputError, match="at least one mode to begin from"):
        refined_poles(frf, FrfForm.RECEPTANCE, band, [])


def test_damping_of_hits_under_an_exponential_window():
    """Damping of 1.5 and 2.0 % out of blocks that decay by their window, not by themselves."""
    rate, n_sample, before = 512.0, 1024, 32
    frequency, damping = np.array([22.0, 35.0]), np.array([0.015, 0.02])
    time = np.arange(n_sample) / rate
    push = np.zeros(n_sample)
    push[before : before + 3] = (50.0, 100.0, 50.0)
    omega = 2 * np.pi * frequency[:, None]
    damped = omega * np.sqrt(1 - damping[:, None] ** 2)
    decay = np.exp(-damping[:, None] * omega * time) / damped
    receptance = (decay * np.sin(damped * time)).sum(axis=0)
    response = np.convolve(push, receptance)[:n_sample] / rate
    measurement = HammerMeasurement(
        impact="I1",
        force=np.tile(push, (3, 1)),
        response=np.tile(response[:, None], (3, 1, 1)),
        channels=("A1 x",),
        units=("m",),
        ranges=(np.inf,),
        rate=rate,
        pretrigger=before / rate,
    )
    estimate = hammer_frf(measurement, HammerOptions(time_constant=0.4, band=(0.5, 100.0)))
    clusters = pole_clusters(poles_over_orders(estimate.frf, FrfForm.RECEPTANCE, (5.0, 80.0)))
    assert [cluster.frequency for cluster in clusters] == pytest.approx(frequency, rel=1e-3)
    assert [cluster.damping for cluster in clusters] == pytest.approx(damping, rel=0.01)


def test_residuals_stand_for_the_mode_left_out():
    """Above the band the chain's last mode is stiffness, U = sum of phi phi / omega²."""
    omega, _, shapes = chain()
    frequency = np.arange(0.25, 35.01, 0.25)
    frf = chain_frf(FrfForm.RECEPTANCE, frequency)
    clusters = pole_clusters(poles_over_orders(frf, FrfForm.RECEPTANCE, (1.0, 35.0)))
    assert len(clusters) == 2
    model = modal_model(frf, FrfForm.RECEPTANCE, (1.0, 35.0), clusters)
    above = np.einsum("nl,nk->lk", shapes[2:] / omega[2:, None] ** 2, shapes[2:, :2])
    # not constant up to 35 Hz with a mode at 42 Hz: larger than the static value, of its sign
    ratio = np.sum(model.upper_residual.real * above) / np.sum(above**2)
    assert 1.0 < ratio < 2.0
    assert model.total_error < 0.02


@pytest.fixture(scope="module")
def still_air():
    """Take a vehicle whose air only compresses: pressure follows the panels alike at all lines."""
    fleet = load_fleet(1)
    (mode,) = fleet.cabin.modes
    still = replace(mode, frequency=1e6, ear_shape=0.0)
    return fleet.bodies["U06-1"], replace(fleet.cabin, modes=(still,))


def as_constants(body, row, column):
    m = 2j * 2 * np.pi * body.frequencies * np.sqrt(1 - body.damping_ratios**2)
    return np.einsum("nl,nk->nlk", row, column) / m[:, None, None]


@pytest.mark.parametrize("kind", ["a/Qdot", "p/F"])
def test_loudspeaker_and_noise_transfer_are_receptance_like(still_air, kind):
    """a/Qdot = u/q and p/F both come as sums of phi G/(w_n² - w² + ...), without powers of w."""
    body, cabin = still_air
    frequency = np.arange(0.25, 90.01, 0.25)
    shapes = interface_shapes(body)[:, :, :3].reshape(body.frequencies.size, -1)
    ear = (panel_pressure(cabin, np.array([40.0]))[0, :1] @ body.shapes_at_panels.T).real.T
    names = tuple(f"{k}" for k in range(shapes.shape[1]))
    if kind == "a/Qdot":
        values = source_motion(body, cabin, frequency)[:, :, :3, :1].reshape(frequency.size, -1, 1)
        frf = Frf(frequency, values, names, ("ear",), "(m/s^2)/(m^3/s^2)")
        expected = as_constants(body, shapes, -ear)
    else:
        values = ear_transfer(body, cabin, frequency)[:, :1, :, :3].reshape(frequency.size, 1, -1)
        frf = Frf(frequency, values, ("ear",), names, "Pa/N")
        expected = as_constants(body, ear, shapes)
    band = (5.0, 90.0)
    clusters = pole_clusters(poles_over_orders(frf, FrfForm.RECEPTANCE, band))
    model = modal_model(frf, FrfForm.RECEPTANCE, band, clusters)

    # equations with a condition of up to 1e14 carry five digits on every processor: the last of
    # the eight modes moves by 1e-5 from order to order, and its median by some 1e-6
    np.testing.assert_allclose(model.frequency, body.frequencies, rtol=1e-5)
    np.testing.assert_allclose(model.damping, body.damping_ratios, rtol=1e-4)
    error = np.abs(model.residues - expected).max() / np.abs(expected).max()
    assert error < 1e-4
    assert model.total_error < 1e-4
    other = modal_model(frf, FrfForm.INERTANCE, band, clusters)
    assert other.total_error > 100 * model.total_error


@pytest.fixture(scope="module", params=CASES)
def vehicle(request, tmp_path_factory):
    """As a good laboratory delivers it, its body the same on all days."""
    folder = tmp_path_factory.mktemp("modes") / request.param
    errors = VehicleErrors(state=NO_SPREAD)
    write_vehicle(folder, 1, request.param, errors=errors, load_cases=(), accelerance=False)
    truth = np.load(folder / "truth/vehicle.npz")
    shapes = truth["shapes_at_interfaces"][:, :, :3].reshape(len(truth["damping_ratios"]), -1)
    measured = np.hstack([shapes, truth["shapes_at_panels"]])
    return body_modes(read_vehicle(folder)), truth, measured


def test_five_modes_of_a_vehicle_out_of_its_files(vehicle):
    part, truth, shapes = vehicle
    frequency, damping = part.model.frequency[:5], part.model.damping[:5]
    assert np.abs(frequency / truth["natural_frequencies"][:5] - 1).max() < 0.005
    assert np.abs(damping / truth["damping_ratios"][:5] - 1).max() < 0.15
    assert np.diag(part.mac(shapes)).min() > 0.95
    assert np.diag(part.mac(shapes, mount_points_only=True)).min() > 0.95
    assert part.model.complexity[:5].max() < 0.1
    assert part.model.total_error < LARGE_ERROR


def test_panels_of_each_mode_add_up_and_are_the_true_ones(vehicle):
    part, truth, _ = vehicle
    cabin = load_fleet(1).cabin
    at_modes = panel_pressure(cabin, truth["natural_frequencies"][:5])[:, 0]
    true = at_modes * truth["shapes_at_panels"][:5]
    true = (true / true.sum(axis=1, keepdims=True)).real
    shares = part.panels.shares[:5]
    assert shares.sum(axis=1) == pytest.approx(1.0, abs=1e-12)
    assert np.abs(shares - true).max() < 0.06
    assert shares.shape == (5, 8)
    assert np.array_equal(shares.argmax(axis=1), true.argmax(axis=1))


def pressure_of_modes(reciprocal, direct, accelerance, ear):
    """Find what the modes bring to the ear without asking any panel, shape (n_mode,).

    With ``φ`` of the body, the ear's share G in a mode and ``m = 2jω_d``: ``a/Q̇ ∝ −φ_c G/m``,
    ``p/F ∝ G φ_i/m``, ``a/F ∝ φ_c φ_i/m``. The first two over the third, by least squares over all
    channels and forces, are ``−G²/m``, which is what the panels add up to.
    """
    channels = [reciprocal.outputs.index(name) for name in accelerance.outputs]
    blows = [direct.inputs.index(name) for name in accelerance.inputs]
    moved = reciprocal.residues[:, channels, reciprocal.inputs.index(ear)]
    heard = direct.residues[:, direct.outputs.index(ear)][:, blows]
    product = moved[:, :, np.newaxis] * heard[:, np.newaxis, :]
    both = accelerance.residues
    return np.sum(both.conj() * product, axis=(1, 2)) / np.sum(np.abs(both) ** 2, axis=(1, 2))


@pytest.fixture(scope="module")
def part(exact_vehicle):
    return body_modes(exact_vehicle[1], n_modes=5)


def test_panels_bring_what_hammer_and_loudspeaker_say_a_mode_brings(exact_vehicle, part):
    """Without errors nothing is missing; without the trunk floor the sum falls short."""
    car = exact_vehicle[1]
    clusters, band = part.model.clusters, part.chart.band
    models = [
        modal_model(frf, form, band, clusters)
        for frf, form in (
            (car.reciprocal, FrfForm.RECEPTANCE),
            (car.direct, FrfForm.RECEPTANCE),
            (car.accelerance, FrfForm.INERTANCE),
        )
    ]
    expected = pressure_of_modes(*models, car.ears[0])[:5]
    pressure = part.panels.pressure[:5]
    assert np.abs(pressure / expected - 1).max() < 0.05
    without = pressure - part.panels.values[:5, part.panels.panels.index("trunk floor")]
    assert abs(without[0] / expected[0]) < 0.6


def test_outputs_are_mount_points_and_panels_in_their_directions(part):
    assert part.model.outputs[:3] == ("EnM x", "EnM y", "EnM z")
    assert part.model.outputs[-1] == "windshield"
    assert part.model.inputs == ("driver ear", "passenger ear")
    assert [place.is_panel for place in part.places] == [False] * 5 + [True] * 8
    labels = [place.label for place in part.places]
    assert labels[3:6] == ["Du left", "Du right", "trunk floor"]
    roof = labels.index("roof")
    assert np.all(part.motion[:, roof, :2] == 0)
    drawn = body_motion(part)
    assert np.asarray(drawn.normals)[roof].tolist() == [0.0, 0.0, -1.0]
    assert drawn.titles[0].startswith("23.")


def test_a_report_has_what_is_known(exact_vehicle, part, described_pictures, tmp_path):
    def in_report(modes, truth=None):
        report = Report("Modes")
        append_modes(report, modes, truth, "U06-1")
        return report

    few = replace(part, n_modes=2)
    report = in_report(few)
    assert list(report.tables) == ["modes", "panel_contributions"]
    table = report.tables["modes"]
    assert "MAC with the truth [1]" not in table
    spread = [100 * cluster.damping_spread for cluster in part.model.clusters[:2]]
    assert table["spread of damping [%]"].tolist() == spread
    hold(report.write(tmp_path).parent / "figures" / "panel_contributions.png", "modal_panels")
    bare = body_modes(replace(exact_vehicle[1], panels=None), n_modes=2)
    assert len(bare.model.outputs) == 15
    report = in_report(bare, bare.model.shapes)
    assert list(report.figures) == ["stabilisation", "mode_shapes"]
    assert report.tables["modes"]["MAC with the truth [1]"].to_numpy() == pytest.approx(1.0)


def test_modes_that_cannot_be_had_are_refused(exact_vehicle, part):
    car = exact_vehicle[1]
    with pytest.raises(InputError, match=r"modes from 20 to 80 Hz .* 12 asked for"):
        body_modes(car, n_modes=12)
    with pytest.raises(InputError, match="one column for each of the 23 outputs"):
        part.mac(np.ones((5, 15)))
    motion = replace(car.panels.motion, frequency=car.panels.motion.frequency + 1)
    with pytest.raises(InputError, match="other lines"):
        body_modes(replace(car, panels=replace(car.panels, motion=motion)))


def test_a_measured_ruler_has_the_ratios_of_a_clamped_beam():
    with np.load(DATA / "pydvma-ruler" / "ruler_ten_lines_0-600Hz.npz") as measured:
        names = tuple(f"line {k}" for k in range(10))
        frf = Frf(measured["freq_hz"], measured["tf"][:, :, None], names, ("hammer",), "any")
    band = (20.0, 400.0)
    clusters = pole_clusters(poles_over_orders(frf, FrfForm.INERTANCE, band, largest_order=16))
    # accelerometer and cable bring one broad pole; bending is damped by a few per cent at most
    bending = [cluster for cluster in clusters if cluster.damping < 0.03]
    frequency = np.array([cluster.frequency for cluster in bending])
    assert frequency == pytest.approx([39.5, 108.7, 212.5, 352.1], rel=0.005)
    ratios = np.array([1.0, 2.800, 5.487, 9.070])
    assert frequency / frequency[0] == pytest.approx(ratios, rel=0.04)
    damping = np.array([cluster.damping for cluster in bending])
    assert damping == pytest.approx([0.005, 0.010, 0.013, 0.007], rel=0.3)
    model = modal_model(frf, FrfForm.INERTANCE, band, clusters)
    assert model.total_error < 0.2
    assert "more than 5 %" in model.verdict


def test_a_mode_just_below_the_first_line_is_fitted_and_not_returned():
    """Left to the residual, a mode at 0.9 of the first line turns the shape of the lowest mode."""
    natural, damping = np.array([18.0, 21.5, 35.0, 52.0]), 0.04
    shapes = np.random.default_rng(3).normal(size=(4, 8))
    lines = np.arange(20.0, 80.25, 0.25)
    s, omega = 2j * np.pi * lines[:, np.newaxis], 2 * np.pi * natural
    values = (shapes[:, 0] / (omega**2 + 2 * damping * omega * s + s**2)) @ shapes
    outputs = tuple(f"point {number}" for number in range(8))
    frf = Frf(lines, values[:, :, np.newaxis], outputs, ("hammer",), "m/N")
    chart = poles_over_orders(frf, FrfForm.RECEPTANCE, (20.0, 80.0))
    clusters, auxiliary = pole_clusters(chart), auxiliary_clusters(chart)
    assert [cluster.frequency for cluster in auxiliary] == pytest.approx([18.0], rel=1e-3)
    likeness = []
    for beside in ((), auxiliary):
        model = modal_model(frf, FrfForm.RECEPTANCE, (20.0, 80.0), clusters, beside)
        assert model.frequency == pytest.approx(natural[1:], rel=1e-3)
        likeness.append(float(mac_matrix(model.shapes, shapes[1:])[0, 0]))
    assert likeness[0] < 0.98
    assert likeness[1] > 0.999
