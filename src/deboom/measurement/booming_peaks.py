"""Booming peaks of level curves, and a synthesised pressure beside a measured one."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
import numpy.typing as npt
from scipy.signal import find_peaks

from deboom.arrays import ComplexArray, RealArray, checked
from deboom.errors import InputError
from deboom.measurement.channels import Band, lines_inside
from deboom.physics.frf import corr_f, corr_s
from deboom.physics.order_tracking import rpm_of_frequency
from deboom.physics.sound_level import spl

PROMINENCE = 6.0
"""How far a peak rises above the higher of the two valleys beside it, at least [dB]."""

TOLERANCE = 1.5
"""How far a peak may move between two designs and still be the same one [Hz]."""


@dataclass(frozen=True)
class BoomingPeak:
    """A local maximum of the level that stands out.

    - `frequency`: frequency of its line [Hz].
    - `rpm`: engine speed at which the order has that frequency [1/min].
    - `level` [dB(A)].
    - `prominence`: height above the higher of the two valleys that part it from higher ground or
      the end of the band [dB].
    """

    frequency: float
    rpm: float
    level: float
    prominence: float


@dataclass(frozen=True)
class PeakChange:
    """One peak before and after.

    - `frequency`: frequency of the peak before or, where there was none, of the peak after [Hz].
    - `before`, `after`: None where the curve has no booming peak near the other one's.
    - `level_before`, `level_after`: level of the peak or, where there is none, the highest level
      within the tolerance of the other curve's peak [dB(A)].
    """

    frequency: float
    before: BoomingPeak | None
    after: BoomingPeak | None
    level_before: float
    level_after: float

    @property
    def change(self) -> float:
        """Level after less level before [dB]."""
        return self.level_after - self.level_before

    @property
    def counts(self) -> bool:
        """Whether it was a peak before, or is a new one that is louder than the curve before.

        What becomes a peak because its neighbours fall further is no boom.
        """
        return self.before is not None or self.change > 0.0


@dataclass(frozen=True)
class MatchedPeaks:
    """Peaks of two curves that are the same one, and those that have no partner.

    - `pairs`: peak of the reference and of the compared curve, by rising frequency.
    - `only_reference`, `only_compared`: peaks of one curve alone, which have no deviation.
    """

    pairs: tuple[tuple[BoomingPeak, BoomingPeak], ...]
    only_reference: tuple[BoomingPeak, ...]
    only_compared: tuple[BoomingPeak, ...]

    @property
    def level_deviations(self) -> RealArray:
        """Level of the compared peak above that of the reference, one per pair [dB]."""
        return np.array([other.level - peak.level for peak, other in self.pairs])


def booming_peaks(
    level: npt.ArrayLike, frequency: npt.ArrayLike, order: float
) -> tuple[BoomingPeak, ...]:
    """Return the booming peaks of one level curve, by rising frequency.

    - `level` (n_frequency,): SPL of each line, finite [dB(A)].
    - `frequency` (n_frequency,) [Hz].
    - `order`: engine order of the curve [1].
    - raises InputError: levels that are no curve over the lines, or are not finite; an order that
      is not positive.

    Topographic prominence of `scipy.signal.find_peaks`, at least `PROMINENCE`. The first and last
    line are no peaks: the curve could rise beyond them.
    """
    curve, lines = np.asarray(level, dtype=float), np.asarray(frequency, dtype=float)
    if curve.ndim != 1 or curve.shape != lines.shape:
        raise InputError(f"levels of shape {curve.shape} are no curve over {lines.size} lines")
    if not np.isfinite(curve).all():
        line = lines[np.flatnonzero(~np.isfinite(curve))[0]]
        raise InputError(f"the level at {line:g} Hz is not finite: a peak has no height beside it")
    return _peaks_of(curve.tobytes(), lines.tobytes(), order)


@lru_cache(maxsize=1024)  # today's curve is compared with that of every design
def _peaks_of(level: bytes, frequency: bytes, order: float) -> tuple[BoomingPeak, ...]:
    curve, lines = np.frombuffer(level), np.frombuffer(frequency)
    positions, properties = find_peaks(curve, prominence=PROMINENCE)
    return tuple(
        BoomingPeak(
            frequency=float(lines[position]),
            rpm=float(rpm_of_frequency(lines[position], order)),
            level=float(curve[position]),
            prominence=float(rise),
        )
        for position, rise in zip(positions, properties["prominences"], strict=True)
    )


def compare_peaks(
    level_before: npt.ArrayLike,
    level_after: npt.ArrayLike,
    frequency: npt.ArrayLike,
    order: float,
) -> tuple[PeakChange, ...]:
    """Return the booming peaks of two curves, paired by frequency.

    Peaks are compared with peaks, never line by line: where one curve has a notch, the difference
    of a line says nothing about booming.

    - `level_before`, `level_after` (n_frequency,): SPL of each line, finite [dB(A)].
    - `frequency` (n_frequency,) [Hz].
    - `order`: engine order of the curves [1].
    - returns: changes by rising frequency; each peak of either curve once.
    - raises InputError: see `booming_peaks`.
    """
    before = booming_peaks(level_before, frequency, order)
    after = booming_peaks(level_after, frequency, order)
    match, lines = match_peaks(before, after), np.asarray(frequency)

    def highest(level: npt.ArrayLike, peak: BoomingPeak) -> float:
        return float(np.asarray(level)[np.abs(lines - peak.frequency) <= TOLERANCE].max())

    changes = [
        PeakChange(old.frequency, old, new, old.level, new.level) for old, new in match.pairs
    ]
    for old in match.only_reference:
        level = highest(level_after, old)
        changes.append(PeakChange(old.frequency, old, None, old.level, level))
    for new in match.only_compared:
        level = highest(level_before, new)
        changes.append(PeakChange(new.frequency, None, new, level, new.level))
    return tuple(sorted(changes, key=lambda change: change.frequency))


def match_peaks(reference: Sequence[BoomingPeak], compared: Sequence[BoomingPeak]) -> MatchedPeaks:
    """Pair the peaks of two curves within `TOLERANCE`, each at most once, the closest two first.

    - `reference`, `compared`: see `booming_peaks`; of curves such as a measured and a synthesised
      one, whose lines may differ.
    """
    candidates = sorted(
        (abs(old.frequency - new.frequency), old.frequency, new.frequency, old, new)
        for old in reference
        for new in compared
    )
    partner: dict[BoomingPeak, BoomingPeak] = {}
    for distance, _, _, old, new in candidates:
        if distance <= TOLERANCE and old not in partner and new not in partner.values():
            partner[old] = new
    return MatchedPeaks(
        pairs=tuple((peak, partner[peak]) for peak in reference if peak in partner),
        only_reference=tuple(peak for peak in reference if peak not in partner),
        only_compared=tuple(peak for peak in compared if peak not in partner.values()),
    )


@checked(frequency="f", reference="f", compared="f")
class PressureComparison:
    """Two pressures at one ear over the same lines of an engine order.

    - `frequency` (n_frequency,) [Hz].
    - `order`: engine order of the lines [1].
    - `reference`, `compared` (n_frequency,): complex peak, such as measured and synthesised [Pa].
    - raises InputError: arrays of different lengths; for its peaks, a pressure of exactly 0.

    The criteria of the thesis (eq. 33, 34) are on pressures, shape complex and scale by magnitudes,
    never on dB curves. Levels are compared at peaks alone, never line by line: in a notch the
    largest difference of the lines says nothing about booming.
    """

    frequency: RealArray
    order: float
    reference: ComplexArray
    compared: ComplexArray

    @property
    def corr_f(self) -> float:
        """Difference in shape of the complex pressures [1]."""
        return float(corr_f(self.compared, self.reference))

    @property
    def corr_s(self) -> float:
        """Difference in scale of the magnitudes [1]."""
        return float(corr_s(np.abs(self.compared), np.abs(self.reference)))

    @property
    def levels(self) -> tuple[RealArray, RealArray]:
        """SPL of the reference and of the compared pressure, shapes (n_frequency,) [dB(A)]."""
        return spl(self.reference, self.frequency), spl(self.compared, self.frequency)

    @property
    def peaks(self) -> MatchedPeaks:
        """Booming peaks of both, paired within the tolerance."""
        first, second = (booming_peaks(level, self.frequency, self.order) for level in self.levels)
        return match_peaks(first, second)

    @property
    def peak_deviation(self) -> float:
        """Largest difference of the levels at paired peaks; nan without a pair [dB]."""
        deviations = np.abs(self.peaks.level_deviations)
        return float(deviations.max()) if deviations.size else float("nan")


def compare_pressure(
    frequency: npt.ArrayLike,
    order: float,
    reference: npt.ArrayLike,
    compared: npt.ArrayLike,
    band: Band,
) -> PressureComparison:
    """Compare two pressures within a band.

    - `frequency` (n_frequency,) [Hz].
    - `order`: engine order of the lines [1].
    - `reference`, `compared` (n_frequency,): complex peak [Pa].
    - `band` (lower, upper): both edges belong to the band [Hz].
    - raises InputError: a band without lines; as `PressureComparison`.
    """
    lines = np.asarray(frequency, dtype=float)
    inside = lines_inside(lines, band, "the comparison of two pressures")
    first, second = np.asarray(reference, dtype=complex), np.asarray(compared, dtype=complex)
    return PressureComparison(lines[inside], order, first[inside], second[inside])
