"""Electric cars: the frozen data, the prior they were drawn from, and the body's own physics."""

import hashlib
from importlib import resources

import numpy as np
import pytest

from deboom.bench.electric_body import HOSES, MOUNTS, POINTS, columns_of
from deboom.bench.electric_fleet import ELECTRIC_FLEET, draw_fleet, frozen_fleet, point_positions
from deboom.bench.parameters import read_data
from deboom.errors import InputError

SHA256 = "d501c881ba11b5ea6bee3675904eb342c3d5f8f551d65696c27b66fc6db076ae"
DATA_SEED = 20261121
LINES = np.arange(20.0, 150.5, 2.5)


def test_frozen_data_are_unchanged() -> None:
    file = resources.files("deboom.bench").joinpath("data", ELECTRIC_FLEET)
    # line ends of a checkout are no change
    content = file.read_bytes().replace(b"\r\n", b"\n")
    assert hashlib.sha256(content).hexdigest() == SHA256


def test_frozen_fleet_is_one_draw_of_the_prior() -> None:
    frozen, drawn = frozen_fleet(), draw_fleet(DATA_SEED)
    assert tuple(frozen.cars) == tuple(drawn.cars) == tuple(f"EV-{k}" for k in range(1, 6))
    for name, car in frozen.cars.items():
        for field in ("frequencies", "damping_ratios", "shapes_at_paths", "shapes_at_panels"):
            stated, again = getattr(car.body, field), getattr(drawn.car(name).body, field)
            np.testing.assert_allclose(stated, again, rtol=6e-9)


@pytest.mark.parametrize("seed", [1, 2, 77])
def test_every_fleet_has_the_measured_level(seed: int) -> None:
    lines = np.arange(30.0, 140.25, 0.5)
    transfer = draw_fleet(seed).car("EV-1").noise_transfer(lines)
    level = np.median(np.abs(transfer[:, columns_of(MOUNTS, 3)]))
    assert level == pytest.approx(2.1e-3, rel=1e-12)


def test_draws_are_repeatable_and_differ() -> None:
    one, again, other = (draw_fleet(seed).car("EV-4").body for seed in (3, 3, 4))
    np.testing.assert_array_equal(one.shapes_at_paths, again.shapes_at_paths)
    assert not np.allclose(one.frequencies, other.frequencies, rtol=1e-3)
    with pytest.raises(InputError, match="seed 0 is refused"):
        draw_fleet(0)
    with pytest.raises(InputError, match=r"no car 'EV-6'.*use EV-1"):
        frozen_fleet().car("EV-6")


def test_noise_transfer_is_the_sum_over_panels_and_modes() -> None:
    data, line = read_data(ELECTRIC_FLEET), 57.5
    car = data["vehicles"]["EV-2"]
    omega, expected = 2 * np.pi * line, 0j
    column = POINTS.index("mount 2") * 6 + 2
    for panel, area in enumerate(data["panel_net_volume_area_m2"]):
        stiffness = data["rho_c2_Pa"] / data["cabin_volume_m3"] * area
        per_metre = complex(stiffness)
        for mode in data["cavity_modes"]:
            own = 2 * np.pi * mode["frequency_Hz"]
            answer = omega**2 / (own**2 - omega**2 + 2j * mode["damping_ratio"] * own * omega)
            shapes = mode["shape_at_panel"][panel] * mode["shape_at_driver_ear"]
            per_metre -= 2 * stiffness * shapes * answer
        for number, frequency in enumerate(car["natural_frequency_Hz"]):
            own, damping = 2 * np.pi * frequency, car["damping_ratio"][number]
            receptance = 1 / (own**2 - omega**2 + 2j * damping * own * omega)
            expected += (
                per_metre
                * car["mode_shape_at_panels"][number][panel]
                * receptance
                * car["mode_shape_at_points"][number][column]
            )
    found = frozen_fleet().car("EV-2").noise_transfer(np.array([line]))[0, column]
    assert abs(found / expected - 1) < 1e-12


def test_body_is_reciprocal_and_passive() -> None:
    for name in ("EV-1", "EV-5"):
        receptance = frozen_fleet().car(name).receptance(LINES)
        np.testing.assert_allclose(receptance, receptance.swapaxes(1, 2), rtol=1e-9, atol=1e-18)
        mobility = 2j * np.pi * LINES[:, None, None] * receptance
        taken = np.linalg.eigvalsh(mobility + mobility.conj().swapaxes(1, 2))
        assert taken.min() > -1e-12 * taken.max()


def test_local_flexibility_is_the_stated_one() -> None:
    car = frozen_fleet().car("EV-3")
    static = car.receptance(np.array([1e-3]))[0].real
    shapes = car.body.shapes_at_paths
    modes = shapes.T @ np.diag((2 * np.pi * car.body.frequencies) ** -2.0) @ shapes
    local = np.diag(static - modes)
    np.testing.assert_allclose(1 / local[columns_of(POINTS, 3)], 2.5e7, rtol=1e-6)
    turning = np.setdiff1d(np.arange(30), columns_of(POINTS, 3))
    np.testing.assert_allclose(1 / local[turning], 2.5e7 * 0.05**2, rtol=1e-6)


def test_points_lie_at_mounts_and_hose_ends() -> None:
    places = point_positions()
    np.testing.assert_allclose(places["mount 1"], [-0.15592, 0.00375, 0.01998])
    axis = np.array([-0.3, 0.5, 0.81])
    reach = 0.36 * axis / np.linalg.norm(axis)
    np.testing.assert_allclose(places[HOSES[0]], np.array([-0.07, 0.035, 0.05]) + reach)
