"""The campaign against the bench's truth: exact without errors."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.interpolate import CubicSpline

from deboom.bench.campaign import (
    NO_ERRORS,
    CampaignErrors,
    CampaignPlan,
    TimeRunPlan,
    load_distribution,
    second_engine_plan,
)
from deboom.bench.campaign_writer import write_campaign
from deboom.bench.layout import CELL_OFFSETS, cell_offsets
from deboom.bench.operating_run import PlannedRun
from deboom.bench.powertrain import load_bench, load_second_engine
from deboom.bench.sensors import ErrorBudget
from deboom.errors import InputError
from deboom.files.campaign import read_campaign, read_time_run
from deboom.measurement.force_transfer import (
    force_transfer_matrix,
    moment_transfer_matrix,
    operating_force,
    without_moments,
)
from deboom.measurement.sensors import SensorKind
from deboom.measurement.virtual_point import sensor_geometry
from deboom.physics.rigid_body import forward_matrices

RUNS = (PlannedRun(5, 220.0, True), PlannedRun(7, 120.0, True), PlannedRun(3, 160.0, True))


def cell_sum(cells, select):
    return sum(select(cell) @ cell.orientation.T for cell in cells)


def transfer_matrix(campaign, mount, cells):
    columns = []
    for axis in "xyz":
        runs = [r for r in campaign.shaker_runs if (r.mount, r.axis) == (mount, axis)]
        sums = [
            cell_sum(cells, lambda cell, r=run: r.response.select(cell.channels).values[:, :, 0])
            for run in runs
        ]
        columns.append(np.mean(sums, axis=0))
    return np.stack(columns, axis=2)


def evaluated(campaign):
    """Displacement and force per run, in the channels of the truth."""
    on_powertrain = campaign.powertrain_mounts
    sensors = campaign.sensors_of(SensorKind.ACCELEROMETER, on_powertrain)
    inverse = np.linalg.pinv(sensor_geometry(sensors).forward)
    names = [name for sensor in sensors for name in sensor.channels]
    points = forward_matrices(
        [mount.positions[0] for mount in campaign.mounts if mount.name in on_powertrain]
    )
    cells = {m: campaign.sensors_of(SensorKind.FORCE_CELL, (m,)) for m in on_powertrain}
    matrices = {m: transfer_matrix(campaign, m, cells[m]) for m in on_powertrain}
    sides = [
        (
            campaign.sensors_of(SensorKind.ACCELEROMETER, (mount.name,), piece)[0],
            campaign.sensors_of(SensorKind.FORCE_CELL, (mount.name,), piece)[0],
        )
        for mount in campaign.mounts
        if mount.name not in on_powertrain
        for piece in mount.pieces
    ]
    displacement, force = [], []
    for run in campaign.runs:
        acceleration = [run.acceleration.select(names).values @ (points @ inverse).T]
        forces = [
            np.linalg.solve(
                matrices[m],
                cell_sum(cells[m], lambda c, r=run: r.cell_force.select(c.channels).values)[
                    ..., None
                ],
            )[..., 0]
            for m in on_powertrain
        ]
        for sensor, cell in sides:
            turned = run.acceleration.select(sensor.channels).values @ sensor.orientation.T
            acceleration.append(turned[:, :1])
            forces.append((run.cell_force.select(cell.channels).values @ cell.orientation.T)[:, :1])
        displacement.append(-np.hstack(acceleration) / (2 * np.pi * run.frequency[:, None]) ** 2)
        force.append(np.hstack(forces))
    return np.array(displacement), np.array(force)


def truth_of(folder, mount_set="M1"):
    with np.load(folder / "truth" / f"{mount_set}.npz") as data:
        return dict(data)


def relative(found, true):
    return np.max(np.abs(found - true) / np.abs(true))


def test_without_errors_everything_comes_back(tmp_path):
    plan = CampaignPlan(("M2",), RUNS, shaker_repeats=2)
    folder = write_campaign(tmp_path / "exact", 1, plan, NO_ERRORS)
    campaign, true = read_campaign(folder), truth_of(folder, "M2")
    displacement, force = evaluated(campaign)
    assert [run.name for run in campaign.runs] == list(true["runs"])
    assert relative(displacement, true["displacement"]) < 1e-9
    assert relative(force, true["force"]) < 1e-9
    assert relative(force / displacement, true["stiffness"]) < 1e-9
    slow = zip(campaign.runs, true["engine_torque"], true["static_force"], strict=True)
    for run, torque, static in slow:
        assert run.static_force_names == tuple(true["channels"])
        assert run.engine_torque == pytest.approx(torque, abs=1e-9)
        assert run.static_force == pytest.approx(static, abs=1e-9)
    bench = load_bench()
    assert campaign.mass_matrix == pytest.approx(bench.powertrain.mass_matrix)
    # the cells miss 6 % of the force, and the first bench mode adds 0.5 % up to 80 Hz
    shaker = next(r for r in campaign.shaker_runs if (r.mount, r.axis) == ("TSM", "x"))
    cells = campaign.sensors_of(SensorKind.FORCE_CELL, ("TSM",))
    column = cell_sum(cells, lambda cell: shaker.response.select(cell.channels).values[:, :, 0])
    assert np.abs(column[0, 0]) == pytest.approx(0.94, abs=0.03)
    growth = np.abs(column[-1, 0] / column[0, 0])
    assert growth == pytest.approx((1 + 0.05 * (80 / 248) ** 2) / (1 + 0.05 * (20 / 248) ** 2))


def test_the_supplier_measured_the_true_static_curve(tmp_path):
    plan = CampaignPlan(("M0",), RUNS[:1], shaker_repeats=1)
    folder = write_campaign(tmp_path / "curves", 5, plan)
    campaign = read_campaign(folder)
    bench = load_bench()
    laws = dict(zip(("EnM x", "EnM y", "EnM z"), bench.powertrain.laws[:3], strict=True))
    scales = []
    for curve in campaign.static_curves:
        if f"{curve.mount} {curve.axis}" in laws:
            true = laws[f"{curve.mount} {curve.axis}"].static_force(curve.deflection)
            loaded = np.abs(true) > 1
            ratio = curve.force[loaded] / true[loaded]
            assert np.ptp(ratio) < 1e-9
            scales.append(ratio[0] - 1)
            assert abs(ratio[0] - 1) < 4 * curve.force_uncertainty
    assert np.ptp(scales) > 0


def demodulated(run, signal, angle, turns, middle):
    """Amplitude of the dominant order at one angle: least squares over some turns."""
    inside = np.abs(angle - middle) < np.pi * turns
    local = (angle[inside] - middle) / (np.pi * turns)
    basis = np.stack(
        [
            wave(order * angle[inside]) * local**power
            for order in (run.order, 0.5, 3.0, 6.0)
            for power in range(3)
            for wave in (np.cos, np.sin)
        ],
        axis=1,
    )
    found = np.linalg.lstsq(basis, signal[inside], rcond=None)[0]
    return found[0] - 1j * found[1]


def test_time_data_carry_the_true_order_on_the_tacho(tmp_path):
    time_plan = TimeRunPlan(first_speed=1500.0, last_speed=1650.0, duration=1.5)
    plan = CampaignPlan(("M1",), RUNS[:1], shaker_repeats=1, time_run=time_plan)
    folder = write_campaign(tmp_path / "time", 2, plan, NO_ERRORS)
    run = read_time_run(folder, "g5_wot220_time")
    with np.load(folder / "truth" / "g5_wot220_time.npz") as data:
        true = dict(data)
    assert run.sample_rate == pytest.approx(16384, rel=1e-6)
    assert run.acceleration.shape == (24576, 24)
    above = run.tacho > 0.5
    after = np.flatnonzero(above[1:] & ~above[:-1]) + 1
    share = (0.5 - run.tacho[after - 1]) / (run.tacho[after] - run.tacho[after - 1])
    pulses = (after - 1 + share) / run.sample_rate
    time = np.arange(run.tacho.size) / run.sample_rate
    turns = CubicSpline(pulses, np.arange(pulses.size) / run.pulses_per_revolution)
    angle = 2 * np.pi * turns(time)
    inside = slice(400, -400)
    assert 60 * turns(time, 1)[inside] == pytest.approx(true["speed"][inside], abs=3.0)
    for signals, spectra in (
        (run.acceleration[:, [0, 1, 2, 15]], true["acceleration"][:, [0, 1, 2, 15]]),
        (run.cell_force[:, [0, 2, 12]], true["cell_force"][:, [0, 2, 12]]),
    ):
        for speed in (1560.0, 1590.0):
            middle = angle[np.argmin(np.abs(true["speed"] - speed))]
            amplitude = CubicSpline(true["frequency"], spectra)(run.order * speed / 60)
            for column, expected in zip(signals.T, amplitude, strict=True):
                found = demodulated(run, column, angle, 8, middle)
                assert abs(found / expected - 1) < 3e-3


def test_a_second_engine_runs_on_the_same_mounts(tmp_path):
    bench = load_second_engine()
    plan = replace(second_engine_plan("M1"), runs=RUNS[:2], shaker_repeats=1)
    folder = write_campaign(tmp_path / "second", 1, plan, NO_ERRORS, bench=bench)
    campaign, true = read_campaign(folder), truth_of(folder)
    assert campaign.order == 2.0
    assert campaign.mass_matrix == pytest.approx(bench.powertrain.mass_matrix)
    displacement, force = evaluated(campaign)
    assert relative(displacement, true["displacement"]) < 1e-9
    assert relative(force / displacement, true["stiffness"]) < 1e-9


def test_inertia_torque_works_against_gas_torque_at_speed():
    torque = load_second_engine().order_torque
    rpm = np.array([1000.0, 2000.0, 4000.0])
    total = torque.torque(np.full(3, 100.0), rpm)
    gas = torque.torque(np.full(3, 100.0), np.zeros(3))
    # four cylinders: -2 m r² ω² sin 2θ, with 0.5 kg and a crank radius of 47.3 mm
    inertia = total - gas
    assert inertia.real == pytest.approx(0, abs=1e-9)
    expected = 2 * 0.5 * 0.0473**2 * (2 * np.pi * rpm / 60) ** 2
    assert inertia.imag == pytest.approx(expected, rel=2e-3)
    assert np.all(np.abs(total[:2]) < np.abs(gas[:2]))


LINES = np.linspace(20.0, 80.0, 31)
PLAN = CampaignPlan(
    ("M1",),
    (PlannedRun(5, 220.0, full_load=True),),
    shaker_repeats=2,
    third_cell=True,
    frequency=LINES,
)
YIELDING = 1 + ErrorBudget().bench_flexibility * (LINES / ErrorBudget().bench_frequency) ** 2


@pytest.fixture(scope="module")
def exact(tmp_path_factory):
    return write_campaign(tmp_path_factory.mktemp("exact") / "campaign", 4, PLAN, NO_ERRORS)


@pytest.fixture(scope="module")
def measured(tmp_path_factory):
    return write_campaign(tmp_path_factory.mktemp("real") / "campaign", 4, PLAN, CampaignErrors())


def cells_of(campaign, mount):
    return campaign.sensors_of(SensorKind.FORCE_CELL, (mount,), "")


def scaled_error(folder, campaign, place, mount):
    """Deviation of the 6×6 matrix from the truth, moments scaled."""
    found = moment_transfer_matrix(campaign, mount)
    with np.load(folder / "truth" / "sensors.npz", allow_pickle=False) as truth:
        cells = truth["cells"][place].reshape(-1, 6)
    forward = sensor_geometry(cells_of(campaign, mount), found.position).forward
    scale = np.repeat([1.0, 1 / found.length], 3)
    true = forward.T @ cells * YIELDING.mean()
    return (found.matrix - true) * np.outer(scale, 1 / scale)


def test_three_cells_carry_force_and_moment_exactly():
    for mount in CELL_OFFSETS:
        offsets = cell_offsets(mount, third_cell=True)
        shares = load_distribution(offsets)
        load = np.array([3.0, -2.0, 5.0, 0.3, -0.2, 0.1])
        forces = shares @ load
        assert forces.sum(axis=0) == pytest.approx(load[:3], abs=1e-13)
        assert np.cross(offsets, forces).sum(axis=0) == pytest.approx(load[3:], abs=1e-13)


def test_exact_pushes_give_the_true_matrix(exact):
    campaign = read_campaign(exact)
    for place, mount in enumerate(campaign.powertrain_mounts):
        assert np.abs(scaled_error(exact, campaign, place, mount)).max() < 1e-12


def test_measured_matrix_is_as_near_as_its_pushes(measured):
    """Half a degree, 0.5 % and 2 mm at an arm of 50 mm: some percent."""
    campaign = read_campaign(measured)
    for place, mount in enumerate(campaign.powertrain_mounts):
        error = np.abs(scaled_error(measured, campaign, place, mount))
        assert 1e-4 < error.max() < 0.15
        assert moment_transfer_matrix(campaign, mount).condition_number < 1.5


def test_moments_are_the_reason_for_what_a_matrix_of_forces_misses(exact):
    campaign = read_campaign(exact)
    (run,) = campaign.runs
    with np.load(exact / "truth" / "M1.npz", allow_pickle=False) as truth:
        force, moment = truth["force"][0], truth["moment"][0]
    assert moment.shape == (LINES.size, 3, 3)
    for place, mount in enumerate(campaign.powertrain_mounts):
        cells = cells_of(campaign, mount)
        six = moment_transfer_matrix(campaign, mount)
        three = force_transfer_matrix(campaign.shaker_runs, cells, mount)
        true = force[:, 3 * place : 3 * place + 3] * (YIELDING / YIELDING.mean())[:, np.newaxis]
        assert operating_force(six, run.cell_force).values == pytest.approx(true, rel=1e-9)
        without = operating_force(three, run.cell_force).values
        crossing = np.linalg.solve(three.matrix, six.matrix[:3, 3:])
        missed = moment[:, place] @ crossing.T * (YIELDING / YIELDING.mean())[:, np.newaxis]
        assert without - true == pytest.approx(missed, abs=1e-9 * np.abs(true).max())
        forces_of_six = operating_force(without_moments(six), run.cell_force).values
        assert forces_of_six == pytest.approx(without, rel=1e-9)


def test_two_cells_have_no_pushes_and_say_so(tmp_path):
    plan = CampaignPlan(("M1",), PLAN.runs, shaker_repeats=1, frequency=LINES)
    campaign = read_campaign(write_campaign(tmp_path / "two", 4, plan))
    assert campaign.pushes == ()
    with pytest.raises(InputError, match="no push beside the virtual point of mount EnM"):
        moment_transfer_matrix(campaign, "EnM")
    with pytest.raises(InputError, match="there is no mount 'X'"):
        moment_transfer_matrix(campaign, "X")


def test_missing_push_and_doubled_push_are_refused(measured, tmp_path):
    import shutil

    folder = tmp_path / "copy"
    shutil.copytree(measured, folder)
    file = folder / "campaign.toml"
    text = file.read_text(encoding="utf-8")
    head, *entries = text.split("[[pushes]]")
    file.write_text("[[pushes]]".join([head, *entries[1:]]), encoding="utf-8")
    with pytest.raises(InputError, match=r"mount EnM: repeats \[1\] lack some of the pushes"):
        moment_transfer_matrix(read_campaign(folder), "EnM")
    file.write_text("[[pushes]]".join([head, entries[0], *entries]), encoding="utf-8")
    with pytest.raises(InputError, match=r"two \[\[pushes\]\] are of 'EnM  P1 1'"):
        read_campaign(folder)
