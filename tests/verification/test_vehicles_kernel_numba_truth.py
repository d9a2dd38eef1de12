"""Both tiers agree to 1e-9 dB of the sum, with notches and extremes as well."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import kernel_coupled as bench
from deboom.files.platform import read_platform
from deboom.vehicles.coupled_motion import coupled_motion
from deboom.vehicles.fleet import path_contributions
from deboom.vehicles.kernel_coupled_numpy import NUMPY_COUPLED
from deboom.vehicles.kernel_numba import NUMBA, NUMBA_COUPLED
from deboom.vehicles.kernel_numpy import NUMPY

pytest.importorskip("numba", reason="the extra 'fast' is not installed")

WITHIN = 1e-9
SHIPPED = Path(__file__).parents[2] / "studies" / "data" / "u06_f39_f45"


def _perturbed(n, n_variable, seed):
    rng = np.random.default_rng(seed)
    shape = (n, n_variable)
    return rng.uniform(0.8, 1.2, shape) * (1 + 0.05 * rng.normal(size=shape))


@pytest.mark.parametrize("depth", [0.0, 40.0, 80.0])
def test_prescribed_tiers_agree_with_notches_at_every_line(depth):
    rng = np.random.default_rng(4)
    contributions = 1e-3 * (rng.normal(size=(5, 161, 10)) + 1j * rng.normal(size=(5, 161, 10)))
    if depth:
        rest = contributions[:, :, :-1].sum(axis=2)
        largest = np.abs(contributions).max(axis=2)
        phase = np.exp(2j * np.pi * rng.uniform(size=largest.shape))
        contributions[:, :, -1] = -rest + 10 ** (-depth / 20) * largest * phase
    designs = np.vstack([1 + np.outer([0, 1e-4], rng.normal(size=10)), _perturbed(200, 10, 5)])
    found, exact = NUMBA.prepare(contributions)(designs), NUMPY.prepare(contributions)(designs)
    np.testing.assert_allclose(found, exact, rtol=0, atol=WITHIN)


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_coupled_tiers_agree_with_lapack_at_small_losses(seed):
    """No pivots are needed: with losses twenty times too small resonances are sharp."""
    shape = bench.Shape("as shipped", 64, 5, 161, 3, 2, 1)
    motion, designs = bench.problem(shape, seed), bench.designs(shape, seed)
    for loss in (1.0, 0.05):
        stiffness = motion.stiffness.real + 1j * loss * motion.stiffness.imag
        resonant = replace(motion, stiffness=stiffness)
        exact = bench.batched(resonant, designs)
        for kernel in (NUMPY_COUPLED, NUMBA_COUPLED):
            found = kernel.prepare(resonant)(designs)
            np.testing.assert_allclose(found, exact, rtol=0, atol=WITHIN)


def test_tiers_agree_on_the_shipped_platform():
    platform = read_platform(SHIPPED)
    fleet, designs = platform.fleet.group("U06"), _perturbed(128, 12, 6)
    for case in platform.load_cases:
        values = path_contributions(fleet, platform.mounts, case).values
        motion = coupled_motion(fleet, platform.mounts, platform.powertrain, case)
        pairs = (
            (NUMPY.prepare(values), NUMBA.prepare(values)),
            (NUMPY_COUPLED.prepare(motion), NUMBA_COUPLED.prepare(motion)),
        )
        for exact, found in pairs:
            np.testing.assert_allclose(found(designs), exact(designs), rtol=0, atol=WITHIN)
