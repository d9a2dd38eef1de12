"""How far the curves of nominally identical vehicles lie apart (thesis, figure 10)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from deboom.arrays import RealArray
from deboom.errors import InputError
from deboom.measurement.channels import Frf
from deboom.physics.sound_level import REFERENCE_PRESSURE


@dataclass(frozen=True, eq=False)
class LevelSpread:
    """Spread of several level curves, line by line.

    Parameters
    ----------
    mean, lowest, highest : array, shape (n_frequency, ...)
        Over the vehicles [dB].
    """

    mean: RealArray
    lowest: RealArray
    highest: RealArray

    def __post_init__(self) -> None:
        for name in ("mean", "lowest", "highest"):
            array = np.array(getattr(self, name), dtype=float)
            array.setflags(write=False)
            object.__setattr__(self, name, array)

    @property
    def range(self) -> RealArray:
        """Highest minus lowest, shape (n_frequency, ...) [dB]."""
        return np.asarray(self.highest - self.lowest)

    def quantile(self, share: float) -> float:
        """Return the range that this share of all lines (and curves) does not exceed [dB]."""
        return float(np.quantile(self.range, share))


def level_spread(levels: npt.ArrayLike) -> LevelSpread:
    """Return the spread of levels over vehicles.

    Parameters
    ----------
    levels : array_like, shape (n_vehicle, n_frequency, ...)
        Of nominally identical vehicles under the same conditions [dB or dB(A)].

    Raises
    ------
    InputError
        Fewer than two vehicles, levels that are not finite.
    """
    values = np.asarray(levels, dtype=float)
    if values.ndim < 2 or values.shape[0] < 2:
        raise InputError(f"a spread needs at least two vehicles, not shape {values.shape}")
    if not np.all(np.isfinite(values)):
        raise InputError("a spread needs finite levels: a pressure of exactly 0 has none")
    return LevelSpread(values.mean(axis=0), values.min(axis=0), values.max(axis=0))


def noise_transfer_levels(vehicles: Sequence[Frf]) -> RealArray:
    """Return the levels of the noise transfer functions of several vehicles.

    Parameters
    ----------
    vehicles : sequence of Frf
        Each with the same ears, inputs and lines [Pa/N].

    Returns
    -------
    array, shape (n_vehicle, n_frequency, n_output, n_input)
        [dB re 20 µPa/N].

    Raises
    ------
    InputError
        Ears, inputs or lines that differ; no vehicle.
    """
    if not vehicles:
        raise InputError("no vehicle to compare: give at least one")
    first = vehicles[0]
    for number, frf in enumerate(vehicles, 1):
        if frf.outputs != first.outputs or frf.inputs != first.inputs:
            raise InputError(
                f"vehicle {number} has other ears or inputs than the first: select() the same "
                "names in the same order"
            )
        if not np.array_equal(frf.frequency, first.frequency):
            raise InputError(f"vehicle {number} has other frequency lines than the first")
    with np.errstate(divide="ignore"):
        levels = 20 * np.log10(np.abs([frf.values for frf in vehicles]) / REFERENCE_PRESSURE)
    return np.asarray(levels)
