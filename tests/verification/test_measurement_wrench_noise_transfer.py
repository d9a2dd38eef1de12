"""A written electric car gives its truth back; errors are as large as they are stated to be."""

from pathlib import Path

import numpy as np
import pytest

from deboom.bench.compressor_operation import operation
from deboom.bench.compressor_plan import CalibrationLevel
from deboom.bench.electric_body import MOUNTS
from deboom.bench.electric_car import mount_stiffnesses
from deboom.bench.electric_car_writer import CAR_PLAN, write_electric_car
from deboom.errors import InputError
from deboom.files.electric_car import read_electric_car
from deboom.measurement.electric_car import ElectricCar
from deboom.measurement.operating_sweep import HoseState
from deboom.measurement.wrench_noise_transfer import wrench_accelerance, wrench_noise_transfer
from deboom.physics.rigid_body import forward_matrices

SEED = 3


@pytest.fixture(scope="module")
def exact(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, ElectricCar]:
    folder = tmp_path_factory.mktemp("car") / "exact"
    write_electric_car(folder, SEED, "EV-2", noise_free=True)
    return folder, read_electric_car(folder)


@pytest.fixture(scope="module")
def measured(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, ElectricCar]:
    folder = tmp_path_factory.mktemp("car") / "measured"
    write_electric_car(folder, SEED, "EV-2", fleet=4)
    return folder, read_electric_car(folder)


def test_folder_holds_what_a_laboratory_delivers(measured: tuple[Path, ElectricCar]) -> None:
    folder, car = measured
    assert car.name == "EV-2"
    assert [point.name for point in car.mounts] == list(MOUNTS)
    assert [p.name for p in car.hoses] == [hose.name for hose in car.operation.hoses]
    assert car.ear == "driver ear"
    assert car.n_averages == 5
    states = [sweep.hoses for sweep in car.operation.sweeps]
    assert states == 2 * [HoseState.STANDARD] + 2 * [HoseState.SOFT]
    assert {path.name for path in car.input_files} >= {"car.toml", "operation.toml", "pressure.uff"}
    assert not any("truth" in path.parts for path in car.input_files)
    assert not folder.with_name("measured.unfinished").exists()


def test_exact_files_give_the_noise_transfer_back(exact: tuple[Path, ElectricCar]) -> None:
    folder, car = exact
    found = wrench_noise_transfer(car)
    with np.load(folder / "truth/body.npz") as truth:
        np.testing.assert_array_equal(found.transfer.frequency, truth["frequency"])
        true = truth["noise_transfer"]
    off = np.abs(found.transfer.values[:, 0] - true).max(axis=0)
    assert np.all(off < 1e-6 * np.abs(true).max(axis=0))
    for consistency in found.consistency.values():
        assert consistency.overall.min() > 1 - 1e-9


def test_exact_files_give_the_body_back(exact: tuple[Path, ElectricCar]) -> None:
    folder, car = exact
    found = wrench_accelerance(car, ("mount 3", car.hoses[0].name))
    assert found.outputs[3:7] == tuple(
        f"{name}" for name in ("mount 3 rx", "mount 3 ry", "mount 3 rz", f"{car.hoses[0].name} x")
    )
    assert found.inputs[2:4] == ("mount 3 z", "mount 3 mx")
    with np.load(folder / "truth/body.npz") as truth:
        squared = ((2 * np.pi * truth["frequency"]) ** 2)[:, None, None]
        for block, point in ((slice(0, 6), 2), (slice(6, 12), 3)):
            receptance = -found.values[:, block, block] / squared
            true = truth["point_receptance"][:, point]
            # rows and columns of different units: each entry by its own largest value
            off = np.abs(receptance - true).max(axis=0) / np.abs(true).max(axis=0)
            assert off.max() < 1e-6
    whole = found.values
    np.testing.assert_allclose(
        whole[:, :6, 6:], whole[:, 6:, :6].swapaxes(1, 2), atol=1e-6 * np.abs(whole).max()
    )


def test_exact_sweeps_are_the_coupled_car(exact: tuple[Path, ElectricCar]) -> None:
    folder, car = exact
    transfer = wrench_noise_transfer(car)
    there = operation(SEED, CalibrationLevel.C2, CAR_PLAN, noise_free=True).laboratory
    rows = there.placed.response_rows(there.sheet)
    forward = forward_matrices(there.compressor.positions)
    for number, sweep in enumerate(car.operation.sweeps):
        with np.load(folder / f"truth/{number}.npz") as truth:
            lines, body = truth["frequency"], truth["body_motion"].reshape(-1, 5, 6)
            squared = (2 * np.pi * lines[:, None]) ** 2
            load, pressure = truth["body_load"], truth["pressure"]
            seen = -squared * (truth["displacement"] @ rows.T)
        assert sweep.holder is not None
        assert sweep.sound is not None
        np.testing.assert_allclose(sweep.acceleration.values, seen, rtol=1e-8, atol=1e-14)
        held = -squared * body[:, :3, :3].reshape(len(lines), 9)
        np.testing.assert_allclose(sweep.holder.values, held, rtol=1e-8, atol=1e-14)
        np.testing.assert_allclose(sweep.sound.values[:, 0], pressure, rtol=1e-10)
        # mounts push with what their two sides differ by
        squeezed = (sweep.acceleration.values @ np.linalg.pinv(rows).T) @ forward.T - held
        stiffness = mount_stiffnesses(there.compressor, lines)
        force = np.einsum(
            "fmab,fmb->fma", stiffness, -(squeezed / squared).reshape(len(lines), 3, 3)
        )
        np.testing.assert_allclose(
            force, load.reshape(-1, 5, 6)[:, :3, :3], rtol=1e-6, atol=1e-8 * np.abs(force).max()
        )
        # what was struck and what ran are one car
        summed = np.einsum("fp,fp->f", transfer.at(lines).transfer.values[:, 0], load)
        np.testing.assert_allclose(summed, pressure, rtol=1e-6, atol=1e-9 * np.abs(pressure).max())


def test_errors_are_as_large_as_stated(measured: tuple[Path, ElectricCar]) -> None:
    folder, car = measured
    found = wrench_noise_transfer(car)
    with np.load(folder / "truth/body.npz") as truth:
        error = np.abs(found.transfer.values[:, 0] - truth["noise_transfer"])
    ratio = np.sqrt(np.mean((error / found.deviation) ** 2, axis=0))
    # 30 functions of errors that are one draw each: not each of them, but all together
    assert 0.7 < np.sqrt(np.mean(ratio**2)) < 1.4
    assert ratio.max() < 2.5
    for consistency in found.consistency.values():
        assert 0.98 < consistency.overall.min() < 0.99999


def test_sweeps_scatter_as_stated(measured: tuple[Path, ElectricCar]) -> None:
    folder, car = measured
    with np.load(folder / "truth/2.npz") as truth:
        pressure = truth["pressure"]
    sound = car.operation.sweeps[2].sound
    assert sound is not None
    gain = np.vdot(pressure, sound.values[:, 0]) / np.vdot(pressure, pressure)
    assert abs(gain - 1) < 4 * 0.2 * np.log(10) / 20
    rest = sound.values[:, 0] - gain * pressure
    expected = np.hypot(np.sqrt(2) * 3e-5, 3e-3 * np.abs(pressure))
    assert np.sqrt(np.mean(np.abs(rest / expected) ** 2)) == pytest.approx(1.0, abs=0.2)


def test_lines_are_chosen_and_never_made(exact: tuple[Path, ElectricCar]) -> None:
    found = wrench_noise_transfer(exact[1], ("mount 2",))
    assert found.transfer.inputs == tuple(
        f"mount 2 {load}" for load in ("x", "y", "z", "mx", "my", "mz")
    )
    some = found.at(np.array([20.0, 90.5]))
    rows = np.searchsorted(found.transfer.frequency, [20.0, 90.5])
    np.testing.assert_array_equal(some.transfer.values, found.transfer.values[rows])
    np.testing.assert_array_equal(some.deviation, found.deviation[rows])
    with pytest.raises(InputError, match=r"no line at 20.2 Hz.*nothing is interpolated"):
        found.at(np.array([20.0, 20.2]))
    with pytest.raises(InputError, match="no point 'mount 4'"):
        wrench_noise_transfer(exact[1], ("mount 4",))
    with pytest.raises(InputError, match="name at least one"):
        wrench_noise_transfer(exact[1], ())
