"""Whether the hoses push back: their load on the running compressor, against what noise feigns."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from deboom.arrays import ComplexArray, RealArray
from deboom.compressor.hose_sweeps import running_compressor, sweep_pairs
from deboom.compressor.unbalance_load import RotationSense

if TYPE_CHECKING:
    from collections.abc import Callable

    from deboom.compressor.hose_sweeps import RunningCompressor, SweepPair
    from deboom.compressor.identify import Identification
    from deboom.measurement.operating_sweep import OperatingTest

REACTION_BANDS = ((30.0, 60.0), (60.0, 90.0), (90.0, 120.0), (120.0, 150.0))
"""In which the reaction is judged; the upper end belongs to the last only [Hz]."""
CONFIDENCE = 0.99
"""Share of tests without hoses that stay below the floor."""


@dataclass(frozen=True)
class ReactionBand:
    """Reaction of the hoses in one band.

    Parameters
    ----------
    low, high : float
        [Hz].
    share : float
        Root mean square over the lines of the reaction over the source's load, noise taken off [1].
    floor : float
        What two sweeps without hoses would show at most, by their noise alone [1].
    measured : float
        As `share`, with the noise in it; a reaction counts as detected above `floor` [1].
    """

    low: float
    high: float
    share: float
    floor: float
    measured: float

    @property
    def detected(self) -> bool:
        """Whether more than noise was seen."""
        return self.measured > self.floor

    @property
    def statement(self) -> str:
        """One sentence for the report."""
        where = f"{self.low:.0f} to {self.high:.0f} Hz"
        if self.detected:
            return (
                f"In {where} the hoses push back with {self.share:.1%} of the source's load (floor "
                f"{self.floor:.1%})."
            )
        return f"In {where} no reaction of the hoses rises above the floor of {self.floor:.1%}."


@dataclass(frozen=True, eq=False)
class HoseReaction:
    """Reaction of the hoses at one pressure.

    Parameters
    ----------
    pair : SweepPair
        What it was found from.
    source : array, shape (n_frequency, 6)
        Load of rotor and gas at the virtual point [N, N m].
    reaction : array, shape (n_frequency, 6)
        Load of the standard hoses on the compressor there [N, N m].
    covariance : array, shape (n_frequency, 6, 6)
        Of the real as of the imaginary part of the reaction.
    share : array, shape (n_frequency,)
        Of the reaction in the source's load, moments over the characteristic length [1].
    bands : tuple of ReactionBand
        Those that hold lines.
    """

    pair: SweepPair
    source: ComplexArray
    reaction: ComplexArray
    covariance: ComplexArray
    share: RealArray
    bands: tuple[ReactionBand, ...]


def hose_reactions(
    test: OperatingTest,
    found: Identification,
    *,
    change: Callable[[RealArray], ComplexArray] | None = None,
    sense: RotationSense = RotationSense.POSITIVE,
    bands: tuple[tuple[float, float], ...] = REACTION_BANDS,
) -> tuple[HoseReaction, ...]:
    """Find the reaction of the hoses at each pressure that was run with and without them.

    Parameters
    ----------
    test : OperatingTest
    found : Identification
        From its hammer test without hoses.
    change : callable, optional
        Lines (n_frequency,) [Hz] → δ of the mounts' stiffness in operation, complex [1]; none by
        default.
    sense : RotationSense
    bands : tuple of (float, float)
        In which it is judged [Hz].

    Returns
    -------
    tuple of HoseReaction

    Raises
    ------
    InputError
        No pressure with standard and soft hoses.
    """
    result = []
    for pair in sweep_pairs(test, found):
        state = running_compressor(
            found,
            pair.frequency,
            change=0.0 if change is None else change(pair.frequency),
            rotor_inertia=test.rotor_inertia,
            sense=sense,
        )
        result.append(hose_reaction(pair, state, bands))
    return tuple(result)


def hose_reaction(
    pair: SweepPair,
    state: RunningCompressor,
    bands: tuple[tuple[float, float], ...] = REACTION_BANDS,
) -> HoseReaction:
    """Take the reaction of the hoses out of two sweeps.

    Parameters
    ----------
    pair : SweepPair
    state : RunningCompressor
        At the lines of the pair.
    bands : tuple of (float, float)
        In which it is judged [Hz].

    Returns
    -------
    HoseReaction

    Notes
    -----
    With F the load of rotor and gas: ``F = AM a_soft``, ``F + R = AM a_standard``, hence
    ``R = AM (a_standard − a_soft)``. An error of AM or of a sensor scales R and feigns none. What
    does feign one is noise, and mounts that changed between the sweeps. The floor is the 99th
    percentile of the band's mean of ``|R|²/|F|²`` under noise alone, a gamma law of the mean and
    the variance of that quadratic form (Satterthwaite 1946).
    """
    source, reaction = (
        np.asarray((state.apparent_mass @ motion[..., np.newaxis])[..., 0])
        for motion in (pair.soft, pair.standard - pair.soft)
    )
    adjoint = np.swapaxes(state.apparent_mass.conj(), -1, -2)
    noise = pair.soft_covariance + pair.standard_covariance
    covariance = np.asarray(state.apparent_mass @ noise @ adjoint)
    weight = np.repeat([1.0, 1 / state.length], 3)
    size = np.linalg.norm(source * weight, axis=1)
    share = np.linalg.norm(reaction * weight, axis=1) / size
    # both parts carry the covariance, and the quadratic form adds them up
    scaled = 2 * covariance * np.outer(weight, weight) / size[:, np.newaxis, np.newaxis] ** 2
    judged = []
    for low, high in bands:
        last = high == max(top for _, top in bands)
        lines = (pair.frequency >= low) & (
            (pair.frequency <= high) if last else (pair.frequency < high)
        )
        if lines.any():
            judged.append(_band(low, high, share[lines], scaled[lines]))
    return HoseReaction(pair, source, reaction, covariance, share, tuple(judged))


def _band(low: float, high: float, share: RealArray, scaled: ComplexArray) -> ReactionBand:
    from scipy.stats import gamma

    n = share.size
    mean = float(np.trace(scaled, axis1=1, axis2=2).real.mean())
    variance = float(np.sum(np.abs(scaled) ** 2)) / n**2
    floor = float(np.sqrt(gamma.ppf(CONFIDENCE, mean**2 / variance, scale=variance / mean)))
    squared = float(np.mean(share**2))
    return ReactionBand(
        low, high, float(np.sqrt(max(squared - mean, 0.0))), floor, float(np.sqrt(squared))
    )
