"""What a component must keep, and what its identified model says of it."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from deboom.compressor.acceptance import Bounds, Characteristic
from deboom.compressor.minimal_parameters import MinimalParameters
from deboom.compressor.quantities import propagated_from

if TYPE_CHECKING:
    from deboom.arrays import RealArray
    from deboom.compressor.identified import IdentifiedCompressor
    from deboom.compressor.model import CompressorModel

DIRECTIONS = ("x", "y", "z", "rx", "ry", "rz")
LINES = 9
"""In a band at most: rubber's stiffness is smooth over frequency."""


@dataclass(frozen=True)
class StiffnessLimit:
    """Window of the dynamic stiffness of one direction.

    Parameters
    ----------
    direction : str
        Of `DIRECTIONS`, at the virtual point.
    band : (float, float)
        Where it must be kept, ends included [Hz].
    bounds : Bounds
        Of its size [N/m, N m/rad].
    """

    direction: str
    band: tuple[float, float]
    bounds: Bounds

    @property
    def name(self) -> str:
        """In words."""
        low, high = self.band
        where = f"{low:g} Hz" if low == high else f"{low:g}–{high:g} Hz"
        return f"dynamic stiffness {self.direction}, {where}"

    @property
    def lines(self) -> RealArray:
        """Where the stiffness is judged, evenly by octaves [Hz]."""
        low, high = self.band
        return np.geomspace(low, high, LINES) if low < high else np.array([low])


@dataclass(frozen=True)
class ComponentLimits:
    """What a component must keep, in SI.

    Parameters
    ----------
    path : Path
        Of the file that states it.
    risk : float
        Largest probability of passing a part that breaks a limit [1].
    static_unbalance, dynamic_unbalance : Bounds or None
        [kg m], [kg m²].
    stiffness : tuple of StiffnessLimit
    """

    path: Path
    risk: float
    static_unbalance: Bounds | None = None
    dynamic_unbalance: Bounds | None = None
    stiffness: tuple[StiffnessLimit, ...] = ()


def stiffness_characteristic(kept: IdentifiedCompressor, limit: StiffnessLimit) -> Characteristic:
    """Read the dynamic stiffness of one direction off an identified compressor.

    Parameters
    ----------
    kept : IdentifiedCompressor
    limit : StiffnessLimit
        Direction and band.

    Returns
    -------
    Characteristic
        ``|v(f) K_dd|`` and its deviation from the whole covariance [N/m, N m/rad]; doubted where
        the model has an alarm, or no line was fitted below or above the band.
    """
    place, lines = DIRECTIONS.index(limit.direction), limit.lines
    parameters = MinimalParameters(kept.length, reference_frequency=kept.reference_frequency)

    def size(model: CompressorModel) -> RealArray:
        return np.asarray(np.abs(model.gain.at(lines)) * model.stiffness[place, place])

    covariance = propagated_from(parameters.model, kept.values, kept.covariance, size)
    return Characteristic(
        limit.name,
        size(kept.model),
        np.sqrt(np.diag(covariance)),
        lines,
        doubt=_stiffness_doubt(kept, limit),
    )


def _stiffness_doubt(kept: IdentifiedCompressor, limit: StiffnessLimit) -> str:
    if kept.alarms:
        return f"the identified model is not to be trusted: {kept.alarms[0]}"
    low, high = min(low for low, _ in kept.bands), max(high for _, high in kept.bands)
    if limit.band[0] < low or limit.band[1] > high:
        return (
            f"the hammer test was fitted in {low:g}–{high:g} Hz, which the limit leaves; strike "
            "with a tip that excites that far, or state the limit within"
        )
    return ""
