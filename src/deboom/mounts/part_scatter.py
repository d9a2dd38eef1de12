"""Scatter of the parts of one number: standard deviation and shares, with intervals."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.stats import chi2, f

from deboom.arrays import AXES, RealArray
from deboom.errors import InputError
from deboom.mounts.characterised_mount import CharacterisedDirection, CharacterisedMount
from deboom.mounts.error_budget import TWO_SIDED

ENOUGH = 20
"""Parts from which on the measured scatter stands alone."""
TAIL = 0.025
"""Probability on either side of an interval: 95 % are inside [1]."""
DOMINATES = 0.5
"""Share of the observed variance from which on measuring is said to dominate [1]."""


@dataclass(frozen=True)
class ScatterPrior:
    """Assumption about a scatter before any part was measured.

    - `sigma`: relative standard deviation, above 0 [1].
    - `weight`: degrees of freedom that it counts like, above 0; 4 is as good as five parts.

    The variance has a scaled inverse chi-square distribution, the conjugate one for normal data (A.
    Gelman et al., "Bayesian Data Analysis", 3rd ed., 2013, ch. 3.2): the parts' degrees of freedom
    and variance are added to it.
    """

    sigma: float = 0.05
    weight: float = 4.0


DEFAULT_PRIOR = ScatterPrior()


@dataclass(frozen=True)
class ShareEstimate:
    """A share of the variance with its interval, each from 0 to 1 [1]."""

    value: float
    lower: float
    upper: float


@dataclass(frozen=True)
class DirectionScatter:
    """Scatter of one direction, such as ``TSM x``; 0 batches: none is recorded.

    `sigma` with its interval is the relative standard deviation of the parts, `observed` that of
    the values, measuring included (nan of fewer than two parts), `measurement` the standard
    uncertainty of one value that was removed, `prior_share` the weight of the prior in the result
    [1].
    """

    name: str
    n_parts: int
    n_batches: int
    sigma: float
    lower: float
    upper: float
    observed: float
    measurement: float
    prior_share: float

    @property
    def dominated(self) -> bool:
        """Whether what is observed is mostly the uncertainty of measuring."""
        return bool(self.measurement**2 >= DOMINATES * self.observed**2)

    @property
    def note(self) -> str:
        """What a reader must know; empty if the parts alone say it."""
        notes = []
        if self.prior_share == 1.0:
            notes.append("assumed: not identified in every part, or fewer than two parts")
        elif self.prior_share > 0.0:
            notes.append(f"{100 * self.prior_share:.0f} % assumed, {self.n_parts} parts")
        if self.dominated:
            notes.append("measuring dominates: the parts cannot be told apart")
        if self.n_batches == 1:
            notes.append("one batch: what batches differ by is not in it")
        return "; ".join(notes)


def direction_scatter(
    name: str,
    values: RealArray,
    uncertainty: RealArray | None = None,
    batches: Sequence[str] | None = None,
    prior: ScatterPrior = DEFAULT_PRIOR,
    *,
    has_common: bool = False,
) -> DirectionScatter:
    """Estimate the scatter of one direction from its parts.

    - `name`: direction, such as ``TSM x``.
    - `values` (n,): logarithm of the stiffness of each part, under equal conditions [1].
    - `uncertainty` (n,), optional: standard uncertainty of each value; default is none [1].
    - `batches`, optional: batch of each part; default is that nobody knows.
    - `prior`: counts below `ENOUGH` parts.
    - `has_common`: whether the uncertainty holds errors that all parts have in common, as the
      budget of one campaign does. They scatter no part; the upper bound then removes nothing.
    - nothing is checked: give one finite uncertainty and one batch per finite value.

    The interval is one of 95 %: ``ν s²/χ²`` bounds the observed variance; the mean variance of
    measuring is taken off. Of several batches the variance is that between plus that within them,
    with the degrees of freedom of Satterthwaite (Biometrics Bulletin 2, 1946). With a known
    uncertainty and without batches it is exact for normal scatter; with the prior it is a credible
    interval of the observed variance.
    """
    values = np.asarray(values, dtype=float)
    error = np.zeros(values.size) if uncertainty is None else np.asarray(uncertainty, dtype=float)
    labels = np.zeros(values.size) if batches is None else np.asarray(batches)
    measuring = float((error**2).mean()) if error.size else 0.0
    observed, degrees = _variance(values, labels)
    weight = prior.weight if values.size < ENOUGH else 0.0
    total = weight + degrees
    variance = (weight * (prior.sigma**2 + measuring) + degrees * observed) / total
    low, high = (total * variance / chi2.ppf(p, total) for p in (1.0 - TAIL, TAIL))
    return DirectionScatter(
        name=name,
        n_parts=values.size,
        n_batches=0 if batches is None else len(np.unique(labels)),
        sigma=_root(variance - measuring),
        lower=_root(low - measuring),
        upper=_root(high if has_common else high - measuring),
        observed=float(np.sqrt(observed)) if degrees else float("nan"),
        measurement=float(np.sqrt(measuring)),
        prior_share=weight / total,
    )


def hardness_share(values: Sequence[RealArray], reliability: float = 1.0) -> ShareEstimate | None:
    """Estimate how much of the variance all axes of a part have in common.

    `values` has one array (n, a) per part number, logarithms of the stiffness of n parts along a
    axes; `reliability` is the share of the observed variance that is not measuring. None if no
    array has two parts and two axes.

    Notes
    -----
    Intraclass correlation of the axes, each brought to a variance of 1, with its interval by the F
    distribution (K. O. McGraw and S. P. Wong, Psychological Methods 1, 1996, case 3). Measuring
    errors of the axes, taken for independent, lower it by the reliability.
    """
    between = within = degrees = inner = axes = 0.0
    for array in values:
        n, a = array.shape
        if n < 2 or a < 2 or not (spread := array.std(axis=0, ddof=1)).all():
            continue
        scaled = (array - array.mean(axis=0)) / spread
        common = a * float((scaled.mean(axis=1) ** 2).sum())
        between += common
        within += float((scaled**2).sum()) - common
        degrees += n - 1
        inner += (n - 1) * (a - 1)
        axes += a * (n - 1)
    if degrees == 0.0:
        return None
    squares = between / degrees, within / inner
    return _intraclass(*squares, degrees, inner, axes / degrees, reliability)


def batch_share(values: RealArray, batches: Sequence[str]) -> ShareEstimate | None:
    """Estimate how much of the variance all parts of a batch have in common.

    Intraclass correlation of the mean over the axes of `values` (n, a), logarithms of stiffness,
    each axis brought to a variance of 1 (case 1 of McGraw and Wong); exact for batches of equal
    size. None for fewer than two batches, or without two parts of one batch.
    """
    spread = values.std(axis=0, ddof=1)
    mean = (values / np.where(spread > 0.0, spread, 1.0)).mean(axis=1)
    labels, place = np.unique(np.asarray(batches), return_inverse=True)
    count = np.bincount(place)
    outer, inner = len(labels) - 1, mean.size - len(labels)
    if outer < 1 or inner < 1:
        return None
    between, within = _mean_squares(mean, place, count)
    return _intraclass(between, within, outer, inner, _size(count), 1.0)


def _variance(values: RealArray, labels: np.ndarray) -> tuple[float, float]:
    """Return variance and degrees of freedom; both 0 of fewer than two parts."""
    if values.size < 2:
        return 0.0, 0.0
    names, place = np.unique(labels, return_inverse=True)
    count = np.bincount(place)
    inner = values.size - len(names)
    if len(names) < 2 or inner < 1:
        return float(values.var(ddof=1)), float(values.size - 1)
    between, within = _mean_squares(values, place, count)
    size = _size(count)
    # a batch that differs less than its parts do is no batch
    parts = np.array([max(between, within) / size, (1.0 - 1.0 / size) * within])
    variance = float(parts.sum())
    degrees = variance**2 / float((parts**2 / np.array([len(names) - 1, inner])).sum())
    return variance, degrees if variance > 0.0 else float(values.size - 1)


def _mean_squares(values: RealArray, place: np.ndarray, count: np.ndarray) -> tuple[float, float]:
    """Return the mean squares between and within batches."""
    means = np.bincount(place, weights=values) / count
    between = float((count * (means - values.mean()) ** 2).sum()) / (len(count) - 1)
    return between, float(((values - means[place]) ** 2).sum()) / (values.size - len(count))


def _size(count: np.ndarray) -> float:
    """Parts per batch that count in an analysis of variance of unequal batches."""
    return float((count.sum() - (count**2).sum() / count.sum()) / (len(count) - 1))


def _intraclass(
    between: float, within: float, outer: float, inner: float, size: float, reliability: float
) -> ShareEstimate:
    ratio = between / within if within > 0.0 else np.inf
    low, high = f.ppf(1.0 - TAIL, outer, inner), f.ppf(1.0 - TAIL, inner, outer)
    shares = [
        1.0 if np.isinf(r) else (r - 1.0) / (r + size - 1.0) / reliability
        for r in (ratio, ratio / low, ratio * high)
    ]
    return ShareEstimate(*np.clip(shares, 0.0, 1.0).tolist())


def _root(variance: float) -> float:
    return float(np.sqrt(max(variance, 0.0)))


FEWEST_POINTS = 20
"""Points at which all parts of a direction must have been measured."""


@dataclass(frozen=True, eq=False)
class LibraryScatter:
    """Scatter of all mounts in a library.

    Three directions per mount; one that is not identified has the prior alone. `hardness` is the
    share of the variance that all axes of a part have in common, over all mounts; `batches` that of
    the parts of a batch, by mount, where batches are recorded.
    """

    directions: tuple[DirectionScatter, ...]
    hardness: ShareEstimate | None
    batches: dict[str, ShareEstimate]

    def direction(self, name: str) -> DirectionScatter | None:
        """Return one direction; None if its mount is not in the library."""
        return next((direction for direction in self.directions if direction.name == name), None)


def library_scatter(
    parts: Sequence[CharacterisedMount], prior: ScatterPrior = DEFAULT_PRIOR
) -> LibraryScatter:
    """Estimate the scatter of every mount and axis from a library's parts.

    - `parts`: parts of one mount have one part number. A part is told by its variant and serial; if
      it was characterised in several campaigns, the mean counts. A serial such as ``B7/012`` names
      the batch before its slash.
    - `prior`: counts below 20 parts.
    - raises InputError: no part, parts of several numbers at one mount, or parts whose surfaces
      have other variables or too few measured points in common.

    Parts are compared at the same preload, amplitude and frequency. What a stiffness factor scales
    is the curve of dynamic stiffness over static force; at equal static force a part whose rubber
    is 5 % stiffer differs by less where its stops carry the load.
    """
    if not parts:
        raise InputError("there is no part to learn the scatter from")
    directions: list[DirectionScatter] = []
    values: list[RealArray] = []
    shares: dict[str, ShareEstimate] = {}
    for mount in dict.fromkeys(part.mount.name for part in parts):
        of_mount = [part for part in parts if part.mount.name == mount]
        of_part, batches = _told_apart(mount, of_mount)
        columns = []
        for axis in AXES:
            name = f"{mount} {axis}"
            along = [part.find(axis) for part in of_mount]
            identified = [d for d in along if d is not None and d.quality.identified]
            if len(identified) < len(along):
                directions.append(direction_scatter(name, np.empty(0), prior=prior))
                continue
            value, uncertainty = _log_stiffness(name, identified, of_part)
            columns.append(value)
            scatter = direction_scatter(name, value, uncertainty, batches, prior, has_common=True)
            directions.append(scatter)
        values.append(np.array(columns).reshape(len(columns), len(of_part)).T)
        share = None if batches is None else batch_share(values[-1], batches)
        if share is not None:
            shares[mount] = share
    measured = [d for d in directions if np.isfinite(d.observed) and d.observed > 0.0]
    trust = [1.0 - (d.measurement / d.observed) ** 2 for d in measured]
    reliability = float(np.mean(trust)) if trust else 0.0
    hardness = hardness_share(values, reliability) if reliability > 0.0 else None
    return LibraryScatter(tuple(directions), hardness, shares)


def _told_apart(
    mount: str, parts: Sequence[CharacterisedMount]
) -> tuple[list[list[int]], tuple[str, ...] | None]:
    """Return the places of each part, and maybe its batch; all must have one part number."""
    numbers = sorted({part.identity.part_number for part in parts})
    if len(numbers) > 1:
        raise InputError(
            f"mount {mount} has parts of the numbers {numbers} in the library: their scatter is "
            "not that of one part, choose one number"
        )
    places: dict[tuple[str, str], list[int]] = {}
    for place, part in enumerate(parts):
        places.setdefault((part.identity.variant, part.identity.serial), []).append(place)
    batched = all("/" in serial for _, serial in places)
    batches = tuple(serial.partition("/")[0] for _, serial in places) if batched else None
    return list(places.values()), batches


def _log_stiffness(
    name: str, directions: Sequence[CharacterisedDirection], of_part: Sequence[list[int]]
) -> tuple[RealArray, RealArray]:
    """Mean of ln |K| over the points that all surfaces were measured at, with its uncertainty.

    One value of each part, the mean where it was characterised several times.
    """
    surfaces = [direction.surface for direction in directions if direction.surface is not None]
    if len({surface.preload_unit for surface in surfaces}) > 1:
        raise InputError(f"{name}: its parts are characterised over different variables")
    points = surfaces[0].region_.points
    common = np.all([surface.supported(points) for surface in surfaces], axis=0)
    if common.sum() < FEWEST_POINTS:
        raise InputError(
            f"{name}: its {len(surfaces)} parts were measured at only {int(common.sum())} common "
            f"points, {FEWEST_POINTS} are needed: measure them in the same runs"
        )
    values = [surface.predict(points[common], extrapolate=True) for surface in surfaces]
    stiffness = np.array([np.log(np.abs(value)).mean() for value in values])
    widths = [direction.quality.half_width_95 or 0.0 for direction in directions]
    squares = (np.array(widths) / TWO_SIDED) ** 2
    return (
        np.array([stiffness[places].mean() for places in of_part]),
        np.array([np.sqrt(squares[places].mean()) for places in of_part]),
    )
