"""A synthesised pressure beside a measured one: shape, scale, and the booming peaks."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from deboom.arrays import ComplexArray, RealArray
from deboom.errors import InputError
from deboom.physics.correlation import corr_f, corr_s
from deboom.physics.sound_level import spl
from deboom.vehicles.booming_peaks import TOLERANCE, MatchedPeaks, booming_peaks, match_peaks


@dataclass(frozen=True, eq=False)
class PressureComparison:
    """Two pressures at one ear over the same lines of an engine order.

    Parameters
    ----------
    frequency : array, shape (n_frequency,)
        [Hz].
    order : float
        Engine order of the lines [1].
    reference, compared : array, shape (n_frequency,)
        Complex peak, such as measured and synthesised [Pa].
    tolerance : float
        Largest distance of two peaks that are the same one [Hz].

    Raises
    ------
    InputError
        Arrays of different lengths, a pressure of exactly 0, a negative tolerance.

    Notes
    -----
    The criteria of the thesis (eq. 33, 34) are on pressures, complex and as magnitudes, never on
    dB curves. The scale factor is the one that the compared curve still needs to meet the
    reference, ``MSF = pᴴ p_ref / (pᴴ p)``; the inverse direction has a property of its own, as the
    thesis does not say which it means. Levels are compared at peaks alone, never line by line: in
    a notch the largest difference of the lines says nothing about booming.
    """

    frequency: RealArray
    order: float
    reference: ComplexArray
    compared: ComplexArray
    tolerance: float = TOLERANCE

    def __post_init__(self) -> None:
        for name in ("frequency", "reference", "compared"):
            array = np.array(getattr(self, name))
            array.setflags(write=False)
            object.__setattr__(self, name, array)
        shapes = {self.frequency.shape, self.reference.shape, self.compared.shape}
        if len(shapes) != 1 or self.frequency.ndim != 1:
            raise InputError(
                f"pressures of shapes {self.reference.shape} and {self.compared.shape} over lines "
                f"of shape {self.frequency.shape} cannot be compared: give one value per line"
            )

    @property
    def corr_f(self) -> float:
        """Difference in shape of the complex pressures [1]."""
        return float(corr_f(self.compared, self.reference))

    @property
    def corr_f_magnitude(self) -> float:
        """Difference in shape of the magnitudes [1]."""
        return float(corr_f(np.abs(self.compared), np.abs(self.reference)))

    @property
    def corr_s(self) -> float:
        """Difference in scale, and in a common phase, of the complex pressures [1]."""
        return float(corr_s(self.reference, self.compared))

    @property
    def corr_s_magnitude(self) -> float:
        """Difference in scale of the magnitudes [1]."""
        return float(corr_s(np.abs(self.reference), np.abs(self.compared)))

    @property
    def corr_s_of_reference(self) -> float:
        """The same the other way round, relative to the reference [1]."""
        return float(corr_s(np.abs(self.compared), np.abs(self.reference)))

    @property
    def levels(self) -> tuple[RealArray, RealArray]:
        """SPL of the reference and of the compared pressure, shapes (n_frequency,) [dB(A)]."""
        return spl(self.reference, self.frequency), spl(self.compared, self.frequency)

    @property
    def rms_difference(self) -> float:
        """Of the levels over all lines; notches rule it [dB]."""
        first, second = self.levels
        return float(np.sqrt(np.mean((second - first) ** 2)))

    @property
    def peaks(self) -> MatchedPeaks:
        """Booming peaks of both, paired within the tolerance."""
        first, second = (booming_peaks(one, self.frequency, self.order) for one in self.levels)
        return match_peaks(first, second, self.tolerance)

    @property
    def peak_deviation(self) -> float:
        """Largest difference of the levels at paired peaks; nan without a pair [dB]."""
        peaks = self.peaks
        return peaks.largest_deviation if peaks.pairs else float("nan")


def compare_pressure(
    frequency: npt.ArrayLike,
    order: float,
    reference: npt.ArrayLike,
    compared: npt.ArrayLike,
    band: tuple[float, float],
) -> PressureComparison:
    """Compare two pressures within a band.

    Parameters
    ----------
    frequency : array_like, shape (n_frequency,)
        [Hz].
    order : float
        Engine order of the lines [1].
    reference, compared : array_like, shape (n_frequency,)
        Complex peak [Pa].
    band : (lower, upper)
        Both edges belong to the band [Hz].

    Raises
    ------
    InputError
        A band without lines; as `PressureComparison`.
    """
    lines = np.asarray(frequency, dtype=float)
    inside = (lines >= band[0]) & (lines <= band[1])
    if not inside.any():
        raise InputError(f"there is no line between {band[0]:g} and {band[1]:g} Hz to compare")
    first, second = np.asarray(reference, dtype=complex), np.asarray(compared, dtype=complex)
    if first.shape != lines.shape or second.shape != lines.shape:
        raise InputError(
            f"pressures of shapes {first.shape} and {second.shape} over lines of shape "
            f"{lines.shape} cannot be compared: give one value per line"
        )
    return PressureComparison(lines[inside], order, first[inside], second[inside])
