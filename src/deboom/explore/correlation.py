"""Correlation of responses, from design to design and within the tolerance.

Correlation coefficients with bootstrap intervals, and families of responses that go together.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pandas as pd
from scipy.cluster.hierarchy import fcluster, linkage
from scipy.spatial.distance import squareform
from scipy.stats import rankdata

from deboom.arrays import RealArray, checked
from deboom.errors import InputError
from deboom.explore.doe import Experiment
from deboom.explore.moments import CONFIDENCE
from deboom.explore.scatter import made_terms, sobol_sample
from deboom.explore.space import DesignSpace, Evaluate, generator, responses
from deboom.tabled import Tabled

FEWEST = 10
"""Designs that a correlation needs at least."""
_CHUNK = 2**19  # numbers in memory at a time


@checked(pearson="r r", pearson_low="r r", pearson_high="r r", spearman="r r")
class Correlations(Tabled):
    """Correlation matrices with their intervals.

    - `names`: names of rows and columns.
    - `pearson`, `pearson_low`, `pearson_high` (r, r): coefficients of the values, with the ends of
      the interval [1].
    - `spearman` (r, r): coefficients of their ranks [1].
    - `n_designs`, `n_draws`: number of rows that were resampled, and of values per row.
    - `n_inputs`: how many of the names, the first ones, are variables; the others are responses.

    See Also
    --------
    deboom.correlation, deboom.doe
    """

    names: tuple[str, ...]
    pearson: RealArray
    pearson_low: RealArray
    pearson_high: RealArray
    spearman: RealArray
    n_designs: int
    n_draws: int
    n_inputs: int = 0

    @property
    def matrix(self) -> pd.DataFrame:
        """Pearson's coefficients, variables and responses × responses [1].

        A figure takes any keyword of seaborn: ``seaborn.heatmap(found.matrix, annot=True)``.
        """
        responses = list(self.names[self.n_inputs :])
        return pd.DataFrame(self.pearson[:, self.n_inputs :], self.names, responses)

    @property
    def of_inputs(self) -> pd.DataFrame:
        """The rows of `table` that pair a variable with a response."""
        names, table = self.names[: self.n_inputs], self.table
        return table[table["first"].isin(names) & ~table["second"].isin(names)]

    @property
    def pairs(self) -> tuple[tuple[int, int], ...]:
        """Rows and columns above the diagonal, row by row."""
        rows, columns = np.triu_indices(len(self.names), 1)
        return tuple(zip(rows.tolist(), columns.tolist(), strict=True))

    @property
    def table(self) -> pd.DataFrame:
        """Pearson's coefficient of each pair with the ends of its interval, and Spearman's."""
        rows, columns = np.triu_indices(len(self.names), 1)
        coefficients = {
            "pearson [1]": self.pearson,
            "pearson from [1]": self.pearson_low,
            "pearson to [1]": self.pearson_high,
            "spearman [1]": self.spearman,
        }
        pair = {"first": np.take(self.names, rows), "second": np.take(self.names, columns)}
        numbers = {name: values[rows, columns] for name, values in coefficients.items()}
        return pd.DataFrame(pair | numbers)

    def among(self, names: Sequence[str]) -> RealArray:
        """Return Pearson's coefficients of all pairs of some names, shape (n_pairs,) [1]."""
        places = [self.names.index(name) for name in names]
        inside = self.pearson[np.ix_(places, places)]
        return np.asarray(inside[np.triu_indices(len(places), 1)])

    def between(self, name: str, others: Sequence[str]) -> RealArray:
        """Return Pearson's coefficients of one name with others, shape (n_others,) [1]."""
        places = [self.names.index(other) for other in others]
        return np.asarray(self.pearson[self.names.index(name), places])


def correlations(
    values: RealArray,
    names: Sequence[str],
    *,
    seed: int,
    resamples: int = 1000,
) -> Correlations:
    """Return Pearson's correlation of all pairs of responses with intervals, and Spearman's.

    - `values` (n, r) or (n, m, r): responses in one row per design, or m values of each design,
      which stay together when designs are resampled.
    - `names`: names of the responses.
    - `seed`, `resamples`: seed from 1 and number of resamples, at least 100, of the bootstrap.
    - raises InputError: fewer than `FEWEST` designs or two responses; a value that is not finite,
      or a response that is the same in all designs, by name; a count or seed that cannot be.

    Percentile bootstrap over the designs: Efron and Tibshirani, "An Introduction to the Bootstrap",
    ch. 13. It takes the designs for independent draws; those of a space-filling plan cover the
    space more evenly, so their interval is rather too wide.
    """
    rows = _checked(values, names, resamples)
    n, m, _ = rows.shape
    random = generator(seed, "correlation bootstrap")
    counts = random.multinomial(n, np.full(n, 1.0 / n), size=resamples).astype(float)
    flat = np.ascontiguousarray(rows.reshape(n * m, -1).T)
    ends = [(1.0 - CONFIDENCE) / 2.0, (1.0 + CONFIDENCE) / 2.0]
    chunk = max(_CHUNK // flat.size, 1)
    drawn = np.concatenate(
        [
            _weighted(flat, np.repeat(counts[start : start + chunk], m, axis=1))
            for start in range(0, resamples, chunk)
        ]
    )
    # a resample of one design over and over has no correlation
    low, high = np.nanquantile(drawn, ends, axis=0)
    pearson, spearman = (np.asarray(np.corrcoef(of)) for of in (flat, rankdata(flat, axis=1)))
    return Correlations(tuple(names), pearson, low, high, spearman, n, m)


def correlation(
    experiment: Experiment, *, inputs: bool = False, seed: int = 1, resamples: int = 1000
) -> Correlations:
    """Correlate all pairs of responses over the designs of a DOE (thesis, figures 44 and 45).

    Parameters
    ----------
    experiment : Experiment
        Of at least two responses and ten designs, see `doe`; with `inputs` one response is enough.
    inputs : bool
        Whether the variables that vary come first, so that each is correlated with every response.
    seed, resamples : int
        Seed from 1 and resamples, at least 100, of the bootstrap behind the intervals.

    Returns
    -------
    Correlations
        Pearson's coefficients with 95 % intervals, and Spearman's, shape (r, r) [1].

    Raises
    ------
    InputError
        One response, too few designs or resamples, or a response that does not vary.

    See Also
    --------
    deboom.doe, deboom.explore.correlation.Correlations, deboom.sobol

    Examples
    --------
    >>> import deboom, numpy as np
    >>> two = deboom.ResponseFunction(lambda x: np.c_[x, 2 * x], ("a",), ("y", "z"), "dB")
    >>> experiment = deboom.doe(two, two.design_space(), n=16)
    >>> round(float(deboom.correlation(experiment, resamples=100).pearson[0, 1]), 6)
    1.0
    >>> deboom.correlation(experiment, inputs=True, resamples=100).matrix.round(6)
         y    z
    a  1.0  1.0
    y  1.0  1.0
    z  1.0  1.0
    """
    computed = experiment.doe
    if not inputs:
        names = computed.response_names
        return correlations(computed.computed, names, seed=seed, resamples=resamples)
    return input_correlations(
        computed.space,
        computed.computed_designs,
        computed.computed,
        computed.response_names,
        seed=seed,
        resamples=resamples,
    )


def input_correlations(
    space: DesignSpace,
    designs: RealArray,
    values: RealArray,
    names: Sequence[str],
    *,
    seed: int,
    resamples: int = 1000,
) -> Correlations:
    """Return the correlations of the variables that vary, then of responses, as `correlations`.

    - `designs` (n, k): of the variables of the space; `values` (n, r): their responses.
    - `names`: names of the responses.
    """
    varied = np.flatnonzero(np.ptp(designs, axis=0) > 0.0) if len(designs) else np.empty(0, int)
    both = [*(space.names[column] for column in varied), *names]
    together = np.hstack([designs[:, varied], values])
    correlated = correlations(together, both, seed=seed, resamples=resamples)
    return replace(correlated, n_inputs=len(varied))


def _checked(values: RealArray, names: Sequence[str], resamples: int) -> RealArray:
    """Values as an array (n, m, r) that can be correlated."""
    rows = np.asarray(values, dtype=float)
    if rows.ndim == 2:
        rows = rows[:, np.newaxis, :]
    if rows.ndim != 3 or rows.shape[2] != len(names):
        raise InputError(
            f"values of shape {np.shape(values)} for {len(names)} responses: bring one column each"
        )
    if len(names) < 2:
        raise InputError("a correlation needs at least two responses")
    if len(rows) < FEWEST:
        raise InputError(
            f"a correlation from {len(rows)} design(s) says nothing: evaluate at least {FEWEST}"
        )
    if resamples < 100:
        raise InputError(f"{resamples} resamples are too few for an interval: take at least 100")
    if not np.all(np.isfinite(rows)):
        design, _, response = (int(place) for place in np.argwhere(~np.isfinite(rows))[0])
        raise InputError(
            f"design {design + 1} has no finite value of '{names[response]}': leave failed designs "
            "out before correlating"
        )
    constant = np.ptp(rows, axis=(0, 1)) <= 1e-12 * np.abs(rows).max(axis=(0, 1))
    if constant.any():
        raise InputError(
            f"response '{names[int(np.argmax(constant))]}' is the same in all {len(rows)} designs "
            "and correlates with nothing: check that a variable acts on it, or leave it out"
        )
    return rows


def _weighted(values: RealArray, weights: RealArray) -> RealArray:
    """Correlate (r, n) in weighted samples (n_samples, n): (n_samples, r, r); NaN: no spread."""
    centred = values - values.mean(axis=1, keepdims=True)
    total = weights.sum(axis=1)[:, np.newaxis]
    mean = weights @ centred.T / total
    product = (centred * weights[:, np.newaxis, :]) @ centred.T
    covariance = product / total[:, :, np.newaxis] - mean[:, :, np.newaxis] * mean[:, np.newaxis]
    variance = np.maximum(np.diagonal(covariance, axis1=1, axis2=2), 0.0)
    with np.errstate(divide="ignore", invalid="ignore"):
        scale = np.sqrt(variance[:, :, np.newaxis] * variance[:, np.newaxis, :])
        return np.asarray(np.clip(covariance / scale, -1.0, 1.0))


def tolerance_scatter(
    evaluate: Evaluate, space: DesignSpace, designs: RealArray, *, n_draws: int, seed: int
) -> tuple[RealArray, RealArray]:
    """Split the responses of toleranced designs, (n, k), into means and scatter.

    Each design has ``n_draws`` scrambled Sobol draws of its own, a power of two: draws that all
    designs share would leave the correlation of the scatter to those few.

    - returns `mean` (n, r): mean of each design over its draws [unit of the responses].
    - returns `scatter` (n, n_draws, r): each draw less the mean of its design; not finite in all
      draws where one could not be computed [unit of the responses].
    - raises InputError: a number of draws that is not a power of two from 2, seed 0, designs of
      another shape.
    """
    rows = []
    for number, design in enumerate(space.checked(designs), 1):
        purpose = f"scatter of design {number}"
        draws = sobol_sample(space.n_variables, n_draws, seed=seed, purpose=purpose).values
        factor, added = made_terms(space, draws)
        try:
            rows.append(responses(evaluate, design * factor + added))
        except (ArithmeticError, np.linalg.LinAlgError):
            rows.append(np.full((n_draws, len(evaluate.response_names)), np.nan))
    drawn = np.stack(rows)
    mean = drawn.mean(axis=1)
    return mean, drawn - mean[:, np.newaxis]


@checked(merges="m 4")
class Families:
    """Responses that go together.

    - `names`, `members`: names of the responses, and the families, the largest first.
    - `merges` (n - 1, 4): tree of the n responses in the layout of
      `scipy.cluster.hierarchy.linkage`; heights are 1 minus the correlation [1].
    - `cut`: least correlation of any two members of a family [1].
    """

    names: tuple[str, ...]
    members: tuple[tuple[str, ...], ...]
    merges: RealArray
    cut: float

    def number(self, name: str) -> int:
        """Return the number of a response's family, from 1."""
        return next(i for i, family in enumerate(self.members, 1) if name in family)


def families(names: Sequence[str], r: RealArray, cut: float = 0.9) -> Families:
    """Group responses so that any two of a group correlate at least as much as asked.

    - `names`: names of at least two responses.
    - `r` (n, n): correlation of the responses [1].
    - `cut`: correlation that is asked for, between 0 and 1 [1].

    Hierarchical clustering of the distance 1 − r with complete linkage: the height of a branch is
    the worst pair below it, so that a cut at 1 − `cut` promises every pair of a family.
    """
    matrix = np.asarray(r, dtype=float)
    if len(names) < 2 or matrix.shape != (len(names), len(names)):
        raise InputError(
            f"families of {len(names)} responses from a matrix of shape {matrix.shape}: bring at "
            "least two responses and one row and column for each"
        )
    if not 0.0 < cut < 1.0:
        raise InputError(f"families cut at r = {cut:g}: take a correlation between 0 and 1")
    distance = np.maximum(1.0 - (matrix + matrix.T) / 2.0, 0.0)
    np.fill_diagonal(distance, 0.0)
    merges = linkage(squareform(distance, checks=False), method="complete")
    labels = fcluster(merges, 1.0 - cut, criterion="distance")
    together = [
        tuple(name for name, label in zip(names, labels, strict=True) if label == family)
        for family in dict.fromkeys(labels)
    ]
    members = tuple(sorted(together, key=len, reverse=True))
    return Families(tuple(names), members, merges, cut)
