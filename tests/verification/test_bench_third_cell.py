"""Three cells and pushes beside the virtual point: all six loads of a mount, against the truth."""

import numpy as np
import pytest

from deboom.bench.campaign_layout import CELL_OFFSETS, cell_offsets
from deboom.bench.campaign_plan import NO_ERRORS, CampaignErrors, CampaignPlan, PlannedRun
from deboom.bench.campaign_sensors import cell_distribution, load_distribution
from deboom.bench.campaign_writer import write_campaign
from deboom.bench.sensors import ErrorBudget
from deboom.errors import InputError
from deboom.files.campaign import read_campaign
from deboom.measurement.channel_geometry import sensor_geometry
from deboom.measurement.force_transfer import force_transfer_matrix, load_scale, operating_force
from deboom.measurement.force_transfer_moments import (
    level_without_moments,
    moment_transfer_matrix,
)
from deboom.measurement.sensors import SensorKind

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
    scale = load_scale(found.length)
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
        assert np.array_equal(cell_distribution(offsets), shares[:, :, :3])


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
        level = level_without_moments(six, run.cell_force)
        assert level == pytest.approx(20 * np.log10(np.abs(without / true)), abs=1e-9)


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
