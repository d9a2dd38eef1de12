"""Acceptance of deliveries: limits, measured characteristics, and verdicts with their risk."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from enum import Enum
from pathlib import Path

import numpy as np
from scipy.special import ndtri

from deboom.arrays import DOFS, RealArray, checked
from deboom.compressor.identified_compressor import ALARM, Identification
from deboom.compressor.model import CompressorModel
from deboom.compressor.parameter_information import propagated
from deboom.compressor.unbalance import Unbalance
from deboom.errors import InputError
from deboom.measurement.compressor_test import HoseState

RISK = 0.05
"""Of passing a part that breaks its limit, and of failing one that keeps it [1]."""
STATIC, DYNAMIC = "static unbalance", "dynamic unbalance"
LINES = 9
"""In a band at most: rubber's stiffness is smooth over frequency."""


class Decision(Enum):
    """What is proven."""

    PASS = "pass"
    FAIL = "fail"
    UNDECIDED = "undecided"


@dataclass(frozen=True)
class Bounds:
    """What a characteristic must keep, in its SI unit; at least one bound.

    `at_least`, `at_most`: lower and upper bound, infinite where there is none. InputError: no
    bound, or the lower one above the upper one.
    """

    at_least: float = -np.inf
    at_most: float = np.inf

    def __post_init__(self) -> None:
        if not np.isfinite(self.at_least) and not np.isfinite(self.at_most):
            raise InputError("a limit needs a bound: at least, at most, or both")
        if not self.at_least < self.at_most:
            raise InputError(
                f"at least {self.at_least:g} and at most {self.at_most:g}: no part keeps both"
            )


@checked(values="n some", deviations="n >0", lines="n")
class Characteristic:
    """A measured property of a component.

    `values` (n,): in SI; several where the limit holds over a band: each must keep it; `deviations`
    (n,): standard deviations, all known causes together [unit of the values]; `lines` (n,): where
    in frequency [Hz]; 0 where the property has none; `is_radius`: the values are lengths of
    measured vectors in a plane, such as an unbalance, not scalars; `doubt`: why the measurement
    proves nothing, whatever it reads; empty where it may be trusted. InputError: no value, other
    shapes, a deviation that is not positive.
    """

    name: str
    values: RealArray
    deviations: RealArray
    lines: RealArray
    is_radius: bool = False
    doubt: str = ""


@dataclass(frozen=True)
class ComponentVerdict:
    """What was decided, at the line that decides.

    `value`, `deviation`: at the line nearest to breaking its limit, counted in deviations; `line`:
    its frequency [Hz]; 0 where there is none; `pass_guard`, `fail_guard`: how far inside a bound a
    value must lie to pass, and how far outside to fail; `shrinkage`: factor by which the deviation
    must shrink to decide, if the value stays; 1 where decided or doubted; `doubt`: why nothing was
    decided, whatever the value; empty where the uncertainty alone decides.
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
        """Ends of what the part may truly have: `value` with the pass guard band to each side."""
        return self.value - self.pass_guard, self.value + self.pass_guard

    @property
    def repetitions(self) -> int:
        """Set-ups whose mean would decide, if the value stays; 1 where decided or doubted."""
        return int(np.ceil(1.0 / max(self.shrinkage, 1e-3) ** 2))


def judge(measured: Characteristic, bounds: Bounds, risk: float = RISK) -> ComponentVerdict:
    """Decide whether a part keeps a limit.

    Parameters
    ----------
    measured : Characteristic
        Values whose errors are normal, with the stated deviations.
    bounds : Bounds
        Bounds in the unit of the characteristic.
    risk : float
        Largest probability of a wrong proof, between 0 and 0.5 [1].

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
    inside = np.minimum(bounds.at_most - measured.values, measured.values - bounds.at_least)
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
    return ComponentVerdict(
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


def overall(verdicts: Sequence[ComponentVerdict]) -> Decision:
    """Decide on the part: it passes with every limit and fails with any.

    A bad part passes with at most the risk of one limit; a good one fails with at most the sum over
    all.

    InputError: no verdict.
    """
    decisions = {verdict.decision for verdict in verdicts}
    if not decisions:
        raise InputError("a part without limits can neither pass nor fail")
    for decision in (Decision.FAIL, Decision.UNDECIDED):
        if decision in decisions:
            return decision
    return Decision.PASS


@dataclass(frozen=True)
class StiffnessLimit:
    """Window of the dynamic stiffness of one direction.

    `direction`: one of ``x y z rx ry rz`` at the virtual point; `band`: where it must be kept, ends
    included [Hz].
    """

    direction: str
    band: tuple[float, float]
    bounds: Bounds

    @property
    def name(self) -> str:
        """Name in words."""
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

    `risk`: largest probability of passing a part that breaks a limit [1].
    """

    path: Path
    risk: float
    static_unbalance: Bounds | None = None
    dynamic_unbalance: Bounds | None = None
    stiffness: tuple[StiffnessLimit, ...] = ()


def component_verdicts(
    unbalance: Unbalance, limits: ComponentLimits
) -> tuple[ComponentVerdict, ...]:
    """Judge every limit of a compressor.

    - `unbalance`: its chosen route's fit over all sweeps gives the unbalances, its hammer test the
      stiffness, that of the mounts as struck.
    - `limits`: what must be kept.
    - returns: verdicts in the order of the file: static, dynamic, then each stiffness.
    """
    verdicts = [
        judge(unbalance_characteristic(unbalance, name), bounds, limits.risk)
        for name, bounds in ((STATIC, limits.static_unbalance), (DYNAMIC, limits.dynamic_unbalance))
        if bounds is not None
    ]
    verdicts += [
        judge(stiffness_characteristic(unbalance.identification, limit), limit.bounds, limits.risk)
        for limit in limits.stiffness
    ]
    return tuple(verdicts)


def stiffness_characteristic(
    identification: Identification, limit: StiffnessLimit
) -> Characteristic:
    """Read the dynamic stiffness of one direction off an identified compressor.

    Returns ``|v(f) K_dd|`` and its deviation from the whole covariance [N/m, N m/rad]; doubted
    where the model has an alarm, or the band reaches beyond those of the fit.
    """
    place, lines = DOFS.index(limit.direction), limit.lines
    calibration = identification.calibrated

    def size(model: CompressorModel) -> RealArray:
        return np.asarray(np.abs(model.gain.at(lines)) * model.stiffness[place, place])

    covariance = propagated(calibration, size)
    return Characteristic(
        limit.name,
        size(calibration.model),
        np.sqrt(np.diag(covariance)),
        lines,
        doubt=_stiffness_doubt(identification, limit),
    )


def unbalance_characteristic(unbalance: Unbalance, name: str) -> Characteristic:
    """Read an unbalance off the global fit of the chosen route.

    Returns its size, with the deviation of the worst direction [kg m, kg m²]; doubted where hoses
    were on or visible, the sweeps are not explained, or the route rests on a refuted model.
    """
    sources = unbalance.chosen.sources
    place = 0 if name == STATIC else 1
    estimate = sources.static if name == STATIC else sources.dynamic
    rows = slice(2 * place, 2 * place + 2)
    deviation = float(np.sqrt(np.linalg.eigvalsh(sources.covariance[rows, rows])[-1]))
    return Characteristic(
        name,
        np.array([abs(estimate.value)]),
        np.array([deviation]),
        np.zeros(1),
        is_radius=True,
        doubt=_unbalance_doubt(unbalance),
    )


def _stiffness_doubt(identification: Identification, limit: StiffnessLimit) -> str:
    """Say why the identified stiffness proves nothing; empty where it does."""
    if identification.alarms:
        return f"the identified model is not to be trusted: {identification.alarms[0]}"
    bands = identification.options.bands
    low, high = min(low for low, _ in bands), max(high for _, high in bands)
    if limit.band[0] < low or limit.band[1] > high:
        return (
            f"the hammer test was fitted in {low:g}–{high:g} Hz, which the limit leaves; strike "
            "with a tip that excites that far, or state the limit within"
        )
    return ""


def _unbalance_doubt(unbalance: Unbalance) -> str:
    """Say why the fit over all sweeps proves nothing; it allows for mounts that changed."""
    result = unbalance.chosen
    if any(sweep.hoses is HoseState.STANDARD for sweep in unbalance.used):
        return (
            "the sweeps were run with the hoses of the vehicle, which push back; run with long "
            "soft hoses and masses"
        )
    if unbalance.hose_alarms:
        return unbalance.hose_alarms[0]
    chi = result.sources.remaining_chi
    if chi > ALARM or not result.fit.converged:
        return (
            f"no rotor, gas and mounts explain the sweeps, residuals are {chi:.2f} times the "
            "noise; look for hoses, loose sensors and a compressor that bends, and run again"
        )
    if unbalance.identification.alarms and result.route.needs_model:
        return (
            f"route {result.route.letter} rests on a model that the hammer test refutes; choose "
            "route d, which needs no model of mounts and foundation"
        )
    return ""
