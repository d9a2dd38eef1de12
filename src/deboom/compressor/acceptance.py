"""Pass, fail or undecided: what a measurement with a known uncertainty proves about a limit."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from enum import Enum

import numpy as np
from scipy.special import ndtri

from deboom.arrays import RealArray
from deboom.errors import InputError
from deboom.measurement.inertance_test import freeze_field

RISK = 0.05
"""Of passing a part that breaks its limit, and of failing one that keeps it [1]."""


class Decision(Enum):
    """What is proven."""

    PASS = "pass"
    FAIL = "fail"
    UNDECIDED = "undecided"


@dataclass(frozen=True)
class Bounds:
    """What a characteristic must keep, in its SI unit; at least one bound.

    Parameters
    ----------
    at_least, at_most : float or None

    Raises
    ------
    InputError
        No bound, or the lower one above the upper one.
    """

    at_least: float | None = None
    at_most: float | None = None

    def __post_init__(self) -> None:
        if self.at_least is None and self.at_most is None:
            raise InputError("a limit needs a bound: at least, at most, or both")
        if None not in (self.at_least, self.at_most) and not self.low < self.high:
            raise InputError(f"at least {self.low:g} and at most {self.high:g}: no part keeps both")

    @property
    def low(self) -> float:
        """Lower bound, −∞ where there is none."""
        return -np.inf if self.at_least is None else self.at_least

    @property
    def high(self) -> float:
        """Upper bound, ∞ where there is none."""
        return np.inf if self.at_most is None else self.at_most


@dataclass(frozen=True, eq=False)
class Characteristic:
    """A measured property of a component.

    Parameters
    ----------
    name : str
        Such as ``static unbalance``.
    values : array, shape (n,)
        In SI; several where the limit holds over a band: each must keep it.
    deviations : array, shape (n,)
        Standard deviations, all known causes together [unit of the values].
    lines : array, shape (n,)
        Where in frequency [Hz]; 0 where the property has none.
    is_radius : bool
        The values are lengths of measured vectors in a plane, such as an unbalance, not scalars.
    doubt : str
        Why the measurement proves nothing, whatever it reads; empty where it may be trusted.

    Raises
    ------
    InputError
        No value, other shapes, a deviation that is not positive.
    """

    name: str
    values: RealArray
    deviations: RealArray
    lines: RealArray
    is_radius: bool = False
    doubt: str = ""

    def __post_init__(self) -> None:
        n = np.size(self.values)
        for field in ("values", "deviations", "lines"):
            freeze_field(self, field, (n,), self.name)
        if n == 0 or not np.all(self.deviations > 0):
            raise InputError(f"{self.name}: no measurement is exact, state its standard deviation")


@dataclass(frozen=True)
class Verdict:
    """What was decided, at the line that decides.

    Parameters
    ----------
    name : str
        Of the characteristic.
    decision : Decision
    bounds : Bounds
    value, deviation : float
        Of the line nearest to breaking its limit, counted in deviations.
    line : float
        Its frequency [Hz]; 0 where there is none.
    pass_guard, fail_guard : float
        How far inside a bound a value must lie to pass, and how far outside to fail.
    shrinkage : float
        Factor by which the deviation must shrink to decide, if the value stays; 1 where decided.
    doubt : str
        Why nothing was decided, whatever the value; empty where the uncertainty alone decides.
    """

    name: str
    decision: Decision
    bounds: Bounds
    value: float
    deviation: float
    line: float
    pass_guard: float
    fail_guard: float
    shrinkage: float = 1.0
    doubt: str = ""

    @property
    def interval(self) -> tuple[float, float]:
        """Values that a part may have and still be passed as this one: guard band to each side."""
        return self.value - self.pass_guard, self.value + self.pass_guard

    @property
    def repetitions(self) -> int:
        """Independent set-ups whose mean would decide, if the value stays; 1 where decided."""
        return int(np.ceil(1.0 / max(self.shrinkage, 1e-3) ** 2))


def judge(measured: Characteristic, bounds: Bounds, risk: float = RISK) -> Verdict:
    """Decide whether a part keeps a limit.

    Parameters
    ----------
    measured : Characteristic
        Errors are normal, with the stated deviations.
    bounds : Bounds
        In the unit of the characteristic.
    risk : float
        Largest probability of a wrong proof, between 0 and 0.5 [1].

    Returns
    -------
    Verdict

    Raises
    ------
    InputError
        A risk that is no such probability.

    Notes
    -----
    The rule of ISO 14253-1 with guard bands from the confidence interval: conformity is proven by a
    value inside the bounds by at least ``g = z σ``, nonconformity by one outside by as much; in
    between neither is. With the one-sided normal quantile ``z(1 − risk)`` a part beyond a bound
    passes with at most the risk, and over a band as well: it must pass at the line that it breaks.

    A part fails by its worst line, found among n, hence ``z(1 − risk/n)`` (Bonferroni). The length
    of a vector is read too long on average, by σ²/2r; it fails where the whole circle that holds
    the vector with probability 1 − risk lies outside, of radius ``σ √(−2 ln risk)``; the deviation
    of a length must be the largest over all directions. Both bounds hold for any length.
    """
    if not 0 < risk < 0.5:
        raise InputError(f"a risk of {risk:g}: state a probability between 0 and 0.5")
    n = measured.values.size
    to_pass = float(-ndtri(risk))
    to_fail = float(np.sqrt(-2 * np.log(risk / n)) if measured.is_radius else -ndtri(risk / n))
    inside = np.minimum(bounds.high - measured.values, measured.values - bounds.low)
    margins = inside / measured.deviations
    worst = int(np.argmin(margins))
    margin = float(margins[worst])
    decision, shrinkage = Decision.UNDECIDED, 1.0
    if not measured.doubt:
        if margin >= to_pass:
            decision = Decision.PASS
        elif margin <= -to_fail:
            decision = Decision.FAIL
        else:
            shrinkage = margin / to_pass if margin > 0 else -margin / to_fail
    deviation = float(measured.deviations[worst])
    return Verdict(
        measured.name,
        decision,
        bounds,
        float(measured.values[worst]),
        deviation,
        float(measured.lines[worst]),
        to_pass * deviation,
        to_fail * deviation,
        shrinkage,
        measured.doubt,
    )


def overall(verdicts: Sequence[Verdict]) -> Decision:
    """Decide on the part: it passes with every limit and fails with any.

    Parameters
    ----------
    verdicts : sequence of Verdict
        At least one.

    Returns
    -------
    Decision
        A bad part passes with at most the risk of one limit; a good one fails with at most the
        sum over all.

    Raises
    ------
    InputError
        No verdict.
    """
    found = {verdict.decision for verdict in verdicts}
    if not found:
        raise InputError("a part without limits can neither pass nor fail")
    if Decision.FAIL in found:
        return Decision.FAIL
    return Decision.UNDECIDED if Decision.UNDECIDED in found else Decision.PASS
