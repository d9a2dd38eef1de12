"""The frozen fleet: noise transfer functions against independent equations,."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import qmc

from deboom.bench.fleet import (
    draw_fleet,
    load_fleet,
    modified_body,
    noise_transfer,
    receptance,
)
from deboom.bench.operating_run import PlannedRun, true_run
from deboom.bench.powertrain import load_bench
from deboom.physics.sound_level import REFERENCE_PRESSURE, spl

FLEET = load_fleet(1)
BODY, CABIN = FLEET.bodies["U06-1"], FLEET.cabin
(MODE,) = CABIN.modes
FREQUENCY = np.linspace(5.0, 90.0, 35)


def test_noise_transfer_against_the_coupled_equations_in_time():
    """Modes and cabin mode as one first-order system ``x' = A x + B f``, ``p = C x + D x'``."""
    modes, paths = BODY.shapes_at_paths.shape
    structure, cavity = np.arange(modes), 2 * modes
    n = 2 * modes + 2
    a, b = np.zeros((n, n)), np.zeros((n, paths))
    for m in structure:
        wn = 2 * np.pi * BODY.frequencies[m]
        a[m, modes + m] = 1
        a[modes + m, m] = -(wn**2)
        a[modes + m, modes + m] = -2 * BODY.damping_ratios[m] * wn
    b[modes + structure] = BODY.shapes_at_paths
    # q'' + 2ζω_c q' + ω_c² q = 2 ρc²/V Σ ψ A u'': pressure mode of a cavity with moving walls
    wc = 2 * np.pi * MODE.frequency
    push = 2 * CABIN.bulk_modulus / CABIN.volume * CABIN.panel_areas * MODE.panel_shape
    a[cavity, cavity + 1] = 1
    a[cavity + 1, cavity] = -(wc**2)
    a[cavity + 1, cavity + 1] = -2 * MODE.damping_ratio * wc
    panel_acceleration = BODY.shapes_at_panels.T @ a[modes : 2 * modes]
    a[cavity + 1] += push @ panel_acceleration
    b[cavity + 1] = push @ (BODY.shapes_at_panels.T @ BODY.shapes_at_paths)
    compression = CABIN.bulk_modulus / CABIN.volume * CABIN.panel_areas
    c = np.zeros(n)
    c[structure] = compression @ BODY.shapes_at_panels.T
    c[cavity] = MODE.ear_shape
    expected = np.array([c @ np.linalg.solve(2j * np.pi * f * np.eye(n) - a, b) for f in FREQUENCY])
    assert noise_transfer(BODY, CABIN, FREQUENCY) == pytest.approx(expected, rel=1e-9)


def test_noise_transfer_at_rest_is_compression_by_the_static_shape():
    static = BODY.shapes_at_panels.T @ np.diag((2 * np.pi * BODY.frequencies) ** -2.0)
    static = static @ BODY.shapes_at_paths
    expected = CABIN.bulk_modulus / CABIN.volume * CABIN.panel_areas @ static
    assert noise_transfer(BODY, CABIN, np.array([1e-4]))[0] == pytest.approx(expected, rel=1e-6)


def test_receptance_is_reciprocal_passive_and_flexible_between_its_modes():
    matrix = receptance(BODY, FREQUENCY)
    assert matrix == pytest.approx(matrix.transpose(0, 2, 1), rel=1e-12)
    # with e^{+jωt} a passive receptance has a negative imaginary part
    assert np.all(np.linalg.eigvalsh(matrix.imag) < 1e-16)
    stiffly = np.diagonal(receptance(BODY, np.array([1e6]))[0]).real
    assert stiffly == pytest.approx(1 / BODY.local_stiffness, rel=1e-6)


@pytest.mark.parametrize(("mass", "stiffness"), [(3.0, 0.0), (0.0, 4e5), (20.0, 1e6), (-2.0, 0.0)])
def test_a_changed_panel_against_the_rank_one_update_of_its_receptance(mass, stiffness):
    undamped = replace(BODY, damping_ratios=np.zeros(8))
    panel, change = 4, np.eye(8)[4]
    changed = modified_body(undamped, mass * change, stiffness * change)
    # Sherman and Morrison: H' = H - h h / (1/z + h_dd), z = Δk - ω² Δm
    h = undamped.modal_receptance(FREQUENCY)
    at_panel = undamped.shapes_at_panels[:, panel]
    to_panel = (h * at_panel) @ undamped.shapes_at_paths
    direct = (h * at_panel) @ at_panel
    z = stiffness - (2 * np.pi * FREQUENCY) ** 2 * mass
    update = np.einsum("fp,fq->fpq", to_panel, to_panel) / (1 / z + direct)[:, None, None]
    expected = receptance(undamped, FREQUENCY) - update
    quiet = replace(changed, damping_ratios=np.zeros(8))
    assert receptance(quiet, FREQUENCY) == pytest.approx(expected, rel=1e-7, abs=1e-18)


FREQUENCY_2 = np.linspace(20.0, 60.0, 161)
NAMES = list(FLEET.bodies)
TRANSFER = {
    name: noise_transfer(body, FLEET.cabin, FREQUENCY_2) for name, body in FLEET.bodies.items()
}
U06 = np.array([TRANSFER[f"U06-{number}"] for number in range(1, 6)])


@pytest.fixture(scope="module")
def force():
    return true_run(load_bench(), PlannedRun(5, 220.0), FREQUENCY_2).path_force


@pytest.fixture(scope="module")
def levels_of_designs(force):
    """Mean dB(A) over the lines per vehicle, for 300 designs in ±15 %."""
    designs = 0.85 + 0.30 * qmc.LatinHypercube(10, rng=5).random(300)
    return {
        name: spl(np.einsum("fp,dp->fd", transfer * force, designs), FREQUENCY_2).mean(0)
        for name, transfer in TRANSFER.items()
    }


def test_the_frozen_fleet_is_draw_452_of_the_prior():
    drawn = draw_fleet(452)
    assert list(drawn) == NAMES
    for name, body in FLEET.bodies.items():
        for field, frozen in vars(body).items():
            # the frozen file keeps nine digits
            again = getattr(drawn[name], field)
            assert again == pytest.approx(frozen, rel=1e-8, abs=1e-11), (name, field)


def test_spread_of_the_noise_transfer_functions():
    spread = np.ptp(20 * np.log10(np.abs(U06)), axis=0)
    assert np.median(spread) == pytest.approx(10.4, abs=0.05)
    assert np.quantile(spread, 0.9) == pytest.approx(17.7, abs=0.05)


def test_peaks_of_the_strut_path():
    strut = np.abs(U06[:4, :, FLEET.paths.index("TSM x")]).max(axis=1)
    peaks = 20 * np.log10(strut / REFERENCE_PRESSURE)
    assert peaks.round().min() == 62
    assert peaks.round().max() == 68


def test_levels_in_5th_gear(force):
    level = spl((U06 * force).sum(axis=2).T, FREQUENCY_2)
    highest = level.max(axis=0)
    assert np.all((highest[:4] > 70.5) & (highest[:4] < 74.5))
    assert highest[4] == pytest.approx(56, abs=0.5)
    spread = np.ptp(level, axis=1)
    assert np.median(spread) == pytest.approx(10.8, abs=0.1)
    assert np.quantile(spread, [0.1, 0.9]) == pytest.approx([5.8, 17.8], abs=0.1)


def test_y_paths_carry_almost_nothing_and_z_paths_little(force):
    contributions = U06 * force
    total = np.sqrt(np.mean(np.abs(contributions.sum(axis=2)) ** 2, axis=1))
    for axis, low, high in (("y", 0.10, 0.45), ("z", 2.5, 9.5)):
        columns = [k for k, path in enumerate(FLEET.paths) if path.endswith(axis)]
        part = np.abs(contributions[:, :, columns].sum(axis=2))
        share = 100 * np.sqrt(np.mean(part**2, axis=1)) / total
        assert np.all((share > low) & (share < high))


def test_correlation_between_groups_and_vehicles(levels_of_designs):
    group = {
        name: np.sum([levels_of_designs[f"{name}-{k}"] for k in range(1, 6)], axis=0)
        for name in ("U06", "F39", "F45")
    }
    between = np.corrcoef(list(group.values()))[np.triu_indices(3, 1)]
    assert between == pytest.approx(0.984, abs=0.01)
    inside = np.corrcoef([levels_of_designs[f"U06-{k}"] for k in range(1, 6)])
    assert inside[:4, :4][np.triu_indices(4, 1)] == pytest.approx(0.9965, abs=0.003)
    # a correlation of 0.5 from 300 designs is known to ±0.04 (one sigma)
    assert inside[4, :4] == pytest.approx(0.50, abs=0.1)


def test_what_the_thesis_saw_in_one_vehicle_the_battery_does(levels_of_designs, force):
    """Vehicle 5 goes its own way and is quieter; its ranking of mounts differs."""

    def first_order_shares(transfer):
        contributions = transfer * force
        slope = (contributions / contributions.sum(axis=1, keepdims=True)).real.mean(axis=0)
        mounts = [path.split()[0] for path in FLEET.paths]
        return {m: sum(slope[k] ** 2 for k in range(10) if mounts[k] == m) for m in set(mounts)}

    for number in range(1, 5):
        shares = first_order_shares(TRANSFER[f"U06-{number}"])
        assert set(sorted(shares, key=shares.get)[-2:]) == {"TSM", "Du"}
    shares = first_order_shares(TRANSFER["U06-5"])
    assert max(shares, key=shares.get) == "GeM"
    others = np.mean([levels_of_designs[f"U06-{k}"].mean() for k in range(1, 5)])
    assert levels_of_designs["U06-5"].mean() < others - 3
