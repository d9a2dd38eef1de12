"""Verdicts on a compressor from its unbalance and its identified model."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from deboom.compressor.acceptance import Characteristic, Verdict, judge
from deboom.compressor.component_limits import ComponentLimits, stiffness_characteristic
from deboom.compressor.identify import ALARM
from deboom.compressor.operating_checks import hose_alarms
from deboom.compressor.routes import CalibratedMeasurementRoute, MeasuredRoute
from deboom.measurement.operating_sweep import HoseState

if TYPE_CHECKING:
    from deboom.compressor.identified import IdentifiedCompressor
    from deboom.compressor.unbalance import Unbalance

STATIC, DYNAMIC = "static unbalance", "dynamic unbalance"


def component_verdicts(
    found: Unbalance, kept: IdentifiedCompressor, limits: ComponentLimits
) -> tuple[Verdict, ...]:
    """Judge every limit.

    Parameters
    ----------
    found : Unbalance
        The fit of its chosen route over all sweeps is judged.
    kept : IdentifiedCompressor
        Of the hammer test: its stiffness is that of the mounts as struck.
    limits : ComponentLimits

    Returns
    -------
    tuple of Verdict
        In the order of the file: static, dynamic, then each stiffness.
    """
    verdicts = []
    for name, bounds in (
        (STATIC, limits.static_unbalance),
        (DYNAMIC, limits.dynamic_unbalance),
    ):
        if bounds is not None:
            verdicts.append(judge(unbalance_characteristic(found, name), bounds, limits.risk))
    for limit in limits.stiffness:
        measured = stiffness_characteristic(kept, limit)
        verdicts.append(judge(measured, limit.bounds, limits.risk))
    return tuple(verdicts)


def unbalance_characteristic(found: Unbalance, name: str) -> Characteristic:
    """Read an unbalance off the global fit of the chosen route.

    Parameters
    ----------
    found : Unbalance
    name : str
        `STATIC` or `DYNAMIC`.

    Returns
    -------
    Characteristic
        Its size, with the deviation of the worst direction [kg m, kg m²]; doubted where hoses were
        on or visible, the sweeps are not explained, or the route rests on a refuted model.
    """
    sources = found.chosen.sources
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
        doubt=_unbalance_doubt(found),
    )


def _unbalance_doubt(found: Unbalance) -> str:
    """Say why the fit over all sweeps proves nothing; it allows for mounts that changed."""
    result = found.chosen
    used = tuple(
        sweep for sweep in found.test.sweeps if sweep.name in {one.sweep for one in result.sweeps}
    )
    if any(sweep.hoses is HoseState.STANDARD for sweep in used):
        return (
            "the sweeps were run with the hoses of the vehicle, which push back; run with long "
            "soft hoses and masses"
        )
    hoses = hose_alarms(used, result.sources.residual_bands)
    if hoses:
        return hoses[0]
    chi = result.sources.remaining_chi
    if chi > ALARM or not result.fit.converged:
        return (
            f"no rotor, gas and mounts explain the sweeps, residuals are {chi:.2f} times the "
            "noise; look for hoses, loose sensors and a compressor that bends, and run again"
        )
    measured = isinstance(result.route, MeasuredRoute | CalibratedMeasurementRoute)
    if found.identification.alarms and not measured:
        return (
            f"route {result.route.letter} rests on a model that the hammer test refutes; choose "
            "route d, which needs no model of mounts and foundation"
        )
    return ""
