"""Does the compressor explain what it was not fitted to: other lines, other impacts?"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from deboom.arrays import ComplexArray, RealArray
from deboom.compressor.placement import Placement
from deboom.errors import InputError
from deboom.measurement.channels import Frf

if TYPE_CHECKING:
    from deboom.compressor.raw_inertance import RawInertance
    from deboom.compressor.self_calibration import SelfCalibration
    from deboom.measurement.placement_tolerances import PlacementTolerances


@dataclass(frozen=True, eq=False)
class HoldOut:
    """Measured FRFs that took no part in a fit, against its prediction.

    Parameters
    ----------
    what : str
        What was held out, in words.
    predicted : Frf
        Of the identified compressor and placement [1/kg].
    measured : Frf
        [1/kg].
    reduced_chi : float
        Rms deviation in units of the noise [1].
    relative_error : float
        Rms deviation over rms of the measured FRFs [1].
    """

    what: str
    predicted: Frf
    measured: Frf
    reduced_chi: float
    relative_error: float


def hold_out_lines(found: SelfCalibration, raw: RawInertance) -> HoldOut:
    """Predict lines that were not fitted, with everything as it was found.

    Parameters
    ----------
    found : SelfCalibration
    raw : RawInertance
        The held-out lines of the same sensors and impacts.

    Returns
    -------
    HoldOut
    """
    predicted = (
        found.placement.response_matrix(found.errors)
        @ found.model.inertance(raw.frf.frequency)
        @ found.placement.excitation_matrix(found.errors).T
    )
    lines = raw.frf.frequency
    what = f"{lines.size} lines from {lines[0]:g} to {lines[-1]:g} Hz"
    return _compare(what, raw.frf, raw.deviation, predicted)


def hold_out_impacts(
    found: SelfCalibration, raw: RawInertance, tolerances: PlacementTolerances
) -> HoldOut:
    """Predict impacts that were not fitted.

    Parameters
    ----------
    found : SelfCalibration
        Fitted without these impacts.
    raw : RawInertance
        All sensors of `found`; only the held-out impacts are judged.
    tolerances : PlacementTolerances

    Returns
    -------
    HoldOut

    Raises
    ------
    InputError
        No impact that the fit did not see.

    Notes
    -----
    Where exactly a new impact struck is not known: its two offsets and two tilts are estimated
    within their tolerances, from hundreds of its FRFs, before it is judged.
    """
    known = {impact.name for impact in found.placement.impacts}
    new = [number for number, impact in enumerate(raw.impacts) if impact.name not in known]
    if not new:
        raise InputError("no impact is left that the identification did not see")
    placement = Placement(raw.sensors, raw.impacts)
    n_channels, n_impacts = 3 * len(raw.sensors), len(raw.impacts)
    errors = np.zeros(len(placement.names))
    hammer = 3 * n_channels
    errors[: hammer + 1] = found.errors[: hammer + 1]
    response = placement.response_matrix(errors)
    seen = response @ found.model.inertance(raw.frf.frequency)
    deviations = placement.deviations(tolerances)
    for number in new:
        offsets = hammer + 1 + 2 * number
        own = [offsets, offsets + 1, offsets + 2 * n_impacts, offsets + 2 * n_impacts + 1]
        for _ in range(3):
            errors[own] += _step(placement, seen, raw, errors, deviations, number, own)
    predicted = seen @ placement.excitation_matrix(errors).T
    names = [raw.impacts[number].name for number in new]
    part = raw.frf.select(inputs=names)
    return _compare(
        f"impacts {', '.join(names)}", part, raw.deviation[:, :, new], predicted[:, :, new]
    )


def _step(
    placement: Placement,
    seen: ComplexArray,
    raw: RawInertance,
    errors: RealArray,
    deviations: RealArray,
    number: int,
    own: list[int],
) -> RealArray:
    """Gauss-Newton step of one impact's offsets and tilts, within their tolerances."""
    hammer = 9 * len(raw.sensors)
    noise = raw.deviation[:, :, number]
    wrench = placement.excitation_matrix(errors)[number]
    change = placement.excitation_derivatives(errors)[[k - hammer for k in own], number]
    misfit = (raw.frf.values[:, :, number] - seen @ wrench) / noise
    slopes = np.moveaxis(seen @ change.T, -1, 0) / noise
    rows = np.concatenate([slopes.real.reshape(4, -1), slopes.imag.reshape(4, -1)], axis=1)
    right = np.concatenate([misfit.real.ravel(), misfit.imag.ravel()])
    prior = 1 / deviations[own] ** 2
    normal = rows @ rows.T + np.diag(prior)
    return np.asarray(np.linalg.solve(normal, rows @ right - prior * errors[own]))


def _compare(what: str, measured: Frf, noise: RealArray, predicted: ComplexArray) -> HoldOut:
    deviation = predicted - measured.values
    frf = Frf(measured.frequency, predicted, measured.outputs, measured.inputs, measured.unit)
    return HoldOut(
        what,
        frf,
        measured,
        float(np.sqrt(np.mean(np.abs(deviation / noise) ** 2) / 2)),
        float(np.sqrt(np.mean(np.abs(deviation) ** 2) / np.mean(np.abs(measured.values) ** 2))),
    )
