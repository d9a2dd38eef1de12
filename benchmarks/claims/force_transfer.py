"""Force transfer matrices with moments.

Three cells below each powertrain mount, three shaker runs at its virtual point and six pushes
beside it make a 6x6 force transfer matrix, from the bench's files through the reader. The mounts of
these campaigns carry moments as rubber of 15 mm radius of gyration does. The cost of leaving the
moments out is what they change in the forces and with them at the ears: noise transfer functions
are known for forces alone, so what moments radiate themselves is not in it.
"""

import tempfile
from functools import cache
from pathlib import Path

import numpy as np

from claims import Claim
from deboom.bench.campaign import NO_ERRORS, CampaignErrors, CampaignPlan
from deboom.bench.campaign_writer import write_campaign
from deboom.bench.operating_run import PlannedRun
from deboom.files.campaign import read_campaign
from deboom.files.platform import read_platform
from deboom.measurement.campaign import Campaign
from deboom.measurement.force_transfer import (
    ForceTransferMatrix,
    force_transfer_matrix,
    moment_transfer_matrix,
    operating_force,
)
from deboom.measurement.sensors import SensorKind
from deboom.measurement.virtual_point import sensor_geometry
from deboom.mounts.characterise import Characterisation, CharacteriseOptions, measuring_chains
from deboom.study.mount_characterisation import CHECK_CASES, CharacterisedBench, moment_cost_table
from deboom.study.platform_model import PEAKS, RMS
from write_library import PLATFORM

SEEDS = range(1, 7)
RUNS = tuple(PlannedRun(gear, limit, full_load=True) for gear, limit in CHECK_CASES)
PLAN = CampaignPlan(("M1",), RUNS, third_cell=True)
YIELD = 5e-2 / 248.0**2
"""How the bench gives way, per squared frequency [s²]."""


@cache
def _bench(seed: int, exact: bool) -> tuple[Campaign, dict[str, np.ndarray], dict[str, np.ndarray]]:
    """One campaign, what its sensors truly do, and its true forces."""
    with tempfile.TemporaryDirectory() as temporary:
        folder = Path(temporary) / "campaign"
        write_campaign(folder, seed, PLAN, NO_ERRORS if exact else CampaignErrors())
        campaign = read_campaign(folder)
        truths = []
        for name in ("sensors", "M1"):
            with np.load(folder / "truth" / f"{name}.npz", allow_pickle=False) as arrays:
                truths.append(dict(arrays))
    return campaign, truths[0], truths[1]


def _matrices(campaign: Campaign) -> list[ForceTransferMatrix]:
    return [moment_transfer_matrix(campaign, mount) for mount in campaign.powertrain_mounts]


def _matrix_error(seed: int, exact: bool) -> float:
    """Largest deviation of a 6x6 matrix from the truth, moments scaled."""
    campaign, sensors, _ = _bench(seed, exact)
    errors = []
    for place, found in enumerate(_matrices(campaign)):
        forward = sensor_geometry(found.cells, found.position).forward
        gives_way = np.mean(1 + YIELD * found.frequency**2)
        true = forward.T @ sensors["cells"][place].reshape(-1, 6) * gives_way
        scale = np.repeat([1.0, 1 / found.length], 3)
        errors.append(np.abs((found.matrix - true) * np.outer(scale, 1 / scale)).max())
    return float(max(errors))


def _force_errors(seed: int, exact: bool) -> np.ndarray:
    """Rms error of the forces, shape (3x3 or 6x6, axis), mean over the mounts [1]."""
    campaign, _, truth = _bench(seed, exact)
    errors = []
    for place, full in enumerate(_matrices(campaign)):
        cells = campaign.sensors_of(SensorKind.FORCE_CELL, (full.mount,), "")
        plain = force_transfer_matrix(campaign.shaker_runs, cells, full.mount)
        true = truth["force"][:, :, 3 * place : 3 * place + 3]
        for transfer in (plain, full):
            found = np.array(
                [operating_force(transfer, r.cell_force).values for r in campaign.runs]
            )
            off = np.mean(np.abs(found - true) ** 2, axis=(0, 1))
            errors.append(np.sqrt(off / np.mean(np.abs(true) ** 2, axis=(0, 1))))
    return np.mean(np.array(errors).reshape(-1, 2, 3), axis=0)


def _moment_cost(seed: int, exact: bool) -> tuple[float, float]:
    """Largest change at a booming peak, and rms over all lines [dB]."""
    campaign, _, _ = _bench(seed, exact)
    options = CharacteriseOptions(self_calibration=False)
    chains = measuring_chains(campaign, options)
    result = Characterisation(campaign, "M1", campaign.runs, chains, {}, options)
    bench = CharacterisedBench(f"bench {seed}", result, None, 0.0)
    table = moment_cost_table(bench, read_platform(PLATFORM))
    return float(table[PEAKS].max()), float(table[RMS].max())


def claims() -> list[Claim]:
    """Six benches with errors, one without."""
    exact = _matrix_error(1, True)
    measured = [_matrix_error(seed, False) for seed in SEEDS]
    condition = max(m.condition_number for s in SEEDS for m in _matrices(_bench(s, False)[0]))
    plain, full = np.median([_force_errors(seed, False) for seed in SEEDS], axis=0)
    without, with_moments = _force_errors(1, True)
    costs = np.array([_moment_cost(seed, False) for seed in SEEDS])
    return [
        Claim(
            "6x6 matrix without any error against the bench's truth, largest entry [1]",
            "at most 1e-9",
            f"{exact:.1e}",
            exact <= 1e-9,
        ),
        Claim(
            "6x6 matrix with all errors against the truth, largest entry, median of 6 benches [1]",
            "at most 0.1: 2 mm at an arm of 50 mm, half a degree",
            f"{np.median(measured):.3f}, condition number at most {condition:.2f}",
            bool(np.median(measured) <= 0.1),
        ),
        Claim(
            "force of a mount without any error, 3x3 → 6x6, rms error along x, y, z [%]",
            "6x6 at most 0.3: the bench gives way",
            _arrow(without, with_moments),
            bool(with_moments.max() <= 0.003),
        ),
        Claim(
            "the same with all errors, median of 6 benches [%]",
            "no claim",
            _arrow(plain, full),
            True,
        ),
        Claim(
            "moments left out: change at booming peaks of 15 vehicles in six runs, median of 6 "
            "benches (largest) [dB]",
            "stated; at most 0.1",
            f"{np.median(costs[:, 0]):.4f} ({costs[:, 0].max():.4f})",
            bool(costs[:, 0].max() <= 0.1),
        ),
        Claim(
            "the same, rms over all lines of the worst vehicle [dB]",
            "stated",
            f"{np.median(costs[:, 1]):.3f} ({costs[:, 1].max():.3f})",
            True,
        ),
    ]


def _arrow(before: np.ndarray, after: np.ndarray) -> str:
    pairs = zip(100 * before, 100 * after, strict=True)
    return ", ".join(f"{one:.2f} → {other:.2f}" for one, other in pairs)
