"""Forces at the paths of a vehicle, by three ways of transfer path analysis, and their check.

===========================  =============================================  ======================
way                          needs                                          transfer functions
===========================  =============================================  ======================
`forces_by_inversion`        accelerances of the receiver on its own        of the same receiver
`forces_by_mount_stiffness`  stiffness of the mounts, motion of both ends   of the same receiver
`blocked_forces_in_situ`     accelerances of the assembled bodies           of assembled bodies
===========================  =============================================  ======================

The first two are classical: the forces belong to the vehicle in which they were measured. The last
is component-based: blocked forces belong to the source with its mounts, in every vehicle. Load
cells on a rig: `deboom.physics.transfer_path.blocked_force_on_rig`.
`validate_on_board` asks whether forces explain responses that took no part in finding them.

Channels that are missing, and other lines or units, raise InputError; further channels are not
looked at.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum

import numpy as np
import pandas as pd

from deboom.arrays import ComplexArray, RealArray, checked
from deboom.errors import InputError
from deboom.measurement.channels import Frf, SideUnits, Spectrum
from deboom.physics.force_inversion import (
    CROSS_VALIDATED,
    FUNCTION_ERROR,
    Inversion,
    InvertedForces,
    invert_for_forces,
)
from deboom.physics.frf import corr_f, corr_s
from deboom.physics.transfer_path import mount_force
from deboom.tabled import Tabled

LARGE_HALF_WIDTH = 0.5
"""Half width of a force over the force from which it is not told [1]."""


class Receiver(Enum):
    """State of the receiver whose transfer functions belong with the forces."""

    UNCOUPLED = "receiver on its own"
    ASSEMBLED = "source and receiver joined"


@dataclass(frozen=True, eq=False)
class PathForces(Tabled):
    """Forces into a receiver, and where they come from.

    - `receiver`: state in which transfer functions are exact with these forces. The other state is
      an approximation.
    - `indicators`: responses they were computed from by inversion; empty for the other ways.
    - `inversion`, optional: regularisation, condition number and noise gain of each line; None for
      the other ways.

    See Also
    --------
    deboom.forces_by_inversion, deboom.forces_by_mount_stiffness, deboom.blocked_forces_in_situ
    """

    force: Spectrum
    receiver: Receiver
    indicators: tuple[str, ...] = ()
    inversion: InvertedForces | None = None

    @property
    def table(self) -> pd.DataFrame:
        """Complex peak force of each path over frequency; by inversion, how far to believe it."""
        table = self.force.table
        if self.inversion is None:
            return table
        for path, unit, width in zip(
            self.force.channels, self.force.units, self.inversion.half_width.T, strict=True
        ):
            table[f"{path}, half width at 90 % [{unit}]"] = width
        table["condition number [1]"] = self.inversion.condition_number
        return table

    @property
    def verdict(self) -> str:
        """One sentence on the forces that an inversion cannot tell; empty where it tells all."""
        if self.inversion is None:
            return ""
        size = np.linalg.norm(self.force.values, axis=0)
        share = np.linalg.norm(self.inversion.half_width, axis=0) / np.where(size > 0, size, 1.0)
        open_ = [
            f"{path} ± {100 * value:.0f} %"
            for path, value in zip(self.force.channels, share, strict=True)
            if value > LARGE_HALF_WIDTH
        ]
        if not open_:
            return ""
        condition = self.inversion.condition_number
        worst = int(np.argmax(condition))
        return (
            f"single forces are not told: {', '.join(open_)} at 90 %; the condition number reaches "
            f"{condition[worst]:.3g} at {self.force.frequency[worst]:g} Hz. Paths that move the "
            "indicators alike share a force, so that their sum may be right: add indicators "
            "between them, or show sums of paths"
        )


def forces_by_inversion(
    accelerance: Frf,
    response: Spectrum,
    inversion: Inversion = CROSS_VALIDATED,
    noise: RealArray | None = None,
    function_error: float = FUNCTION_ERROR,
) -> PathForces:
    """Find the interface forces that explain the indicators: classical transfer path analysis.

    Parameters
    ----------
    accelerance : Frf
        Indicators per force at the paths, source removed, (n_frequency, n_indicator, n_path); of
        any response, ``<unit>/N``.
    response : Spectrum
        The same indicators in operation, (n_frequency, n_indicator) [unit].
    inversion : Inversion
        Regularisation; by default its amount follows from cross-validation at each line.
    noise : array, shape (n_indicator,) or (n_frequency, n_indicator), optional
        Standard deviation of the responses [unit].
    function_error : float
        Standard error of each transfer function, relative [1].

    Returns
    -------
    PathForces
        ``force``, (n_frequency, n_path), complex peak [N], with condition number and half width of
        each line; ``verdict`` names forces that are not told.

    Raises
    ------
    InputError
        A line at 0 Hz, more unknown forces than indicators, singular positions.

    See Also
    --------
    deboom.forces_by_mount_stiffness, deboom.blocked_forces_in_situ
    deboom.measurement.path_forces.PathForces

    Examples
    --------
    >>> import deboom
    >>> rail = deboom.Frf([30.0], [[[2.0], [1.0]]], ("rail", "dash"), ("TSM x",), "m/s^2/N")
    >>> seen = deboom.Spectrum([30.0], [[0.2, 0.1]], ("rail", "dash"), "m/s^2")
    >>> deboom.forces_by_inversion(rail, seen).force.values.real.round(3)
    array([[0.1]])
    """
    return _inverted(accelerance, response, inversion, noise, function_error, Receiver.UNCOUPLED)


def blocked_forces_in_situ(
    accelerance: Frf,
    response: Spectrum,
    inversion: Inversion = CROSS_VALIDATED,
    noise: RealArray | None = None,
    function_error: float = FUNCTION_ERROR,
) -> PathForces:
    """Find the blocked forces of a source in the place where it runs, ``f_bl = (Y^AB)⁺ a``.

    Any receiver will do, a vehicle or a rig: what gives way is part of Y^AB.

    Parameters
    ----------
    accelerance : Frf
        Indicators on the receiver per force at the interface, source mounted,
        (n_frequency, n_indicator, n_path) [unit/N].
    response : Spectrum
        The same indicators in operation, (n_frequency, n_indicator) [unit].
    inversion : Inversion
        Regularisation; by default its amount follows from cross-validation at each line.
    noise : array, shape (n_indicator,) or (n_frequency, n_indicator), optional
        Standard deviation of the responses [unit].
    function_error : float
        Standard error of each transfer function, relative [1].

    Returns
    -------
    PathForces
        ``force``, (n_frequency, n_path), complex peak [N], with condition number and half width of
        each line; ``verdict`` names forces that are not told.

    Raises
    ------
    InputError
        A line at 0 Hz, more unknown forces than indicators, singular positions.

    See Also
    --------
    deboom.component_tpa, deboom.forces_by_inversion, deboom.measurement.path_forces.PathForces

    References
    ----------
    Moorhouse, Elliott and Evans, "In situ measurement of the blocked force of structure-borne sound
    sources", Journal of Sound and Vibration 325, 2009.

    Examples
    --------
    >>> import deboom
    >>> joined = deboom.Frf([30.0], [[[2.0], [1.0]]], ("rail", "dash"), ("TSM x",), "m/s^2/N")
    >>> seen = deboom.Spectrum([30.0], [[0.2, 0.1]], ("rail", "dash"), "m/s^2")
    >>> deboom.blocked_forces_in_situ(joined, seen).receiver.value
    'source and receiver joined'
    """
    return _inverted(accelerance, response, inversion, noise, function_error, Receiver.ASSEMBLED)


def forces_by_mount_stiffness(
    stiffness: Spectrum, source: Spectrum, receiver: Spectrum
) -> PathForces:
    """Find the interface forces from the deflection of the mounts, ``g = K (u_A − u_B)``.

    Parameters
    ----------
    stiffness : Spectrum
        Complex dynamic stiffness, (n_frequency, n_path) [N/m].
    source, receiver : Spectrum
        Displacement above and below each mount, the same channels, complex peak [m].

    Returns
    -------
    PathForces
        ``force``, (n_frequency, n_path), complex peak [N].

    Raises
    ------
    InputError
        Other units, lines that differ, a path without displacement.

    See Also
    --------
    deboom.forces_by_inversion, deboom.blocked_forces_in_situ, deboom.analyse_paths
    deboom.measurement.path_forces.PathForces

    Examples
    --------
    >>> import deboom
    >>> lines, path = [30.0], ("TSM x",)
    >>> stiffness = deboom.Spectrum(lines, [[2e5]], path, "N/m")
    >>> above, below = (deboom.Spectrum(lines, [[s]], path, "m") for s in (1e-4, 2e-5))
    >>> deboom.forces_by_mount_stiffness(stiffness, above, below).force.values.real.round(3)
    array([[16.]])
    """
    _refuse_other_unit(stiffness.unit, "N/m", "mount stiffness")
    paths, lines = stiffness.channels, stiffness.frequency
    above = _of_paths(source, paths, lines, "m", "source displacement")
    below = _of_paths(receiver, paths, lines, "m", "receiver displacement")
    values = mount_force(stiffness.values, above, below)
    return PathForces(Spectrum(lines, values, paths, "N"), Receiver.UNCOUPLED)


def _inverted(
    accelerance: Frf,
    response: Spectrum,
    inversion: Inversion,
    noise: RealArray | None,
    function_error: float,
    receiver: Receiver,
) -> PathForces:
    lines, indicators = accelerance.frequency, accelerance.outputs
    sides = accelerance.unit
    loads = sides.inputs if isinstance(sides, SideUnits) else ("N",) * len(accelerance.inputs)
    explained = accelerance.response_units(loads)
    seen = [
        unit
        for name, unit in zip(response.channels, response.units, strict=True)
        if name in indicators
    ]
    if set(seen) - set(explained):
        raise InputError(
            f"loads times transfer functions in {accelerance.unit} are "
            f"{', '.join(dict.fromkeys(explained))}, the responses of the indicators are in "
            f"{', '.join(dict.fromkeys(seen))}: convert one of them first"
        )
    measured = _of_paths(response, indicators, lines, explained, "response of the indicators")
    if lines[0] <= 0:
        raise InputError(
            "the line at 0 Hz has no acceleration to invert: leave it out of the transfer "
            "functions and of the responses"
        )
    paths = accelerance.inputs
    inverted = invert_for_forces(
        accelerance.values, measured, inversion, noise, paths, function_error
    )
    force = Spectrum(lines, inverted.force, paths, loads)
    return PathForces(force, receiver, indicators, inverted)


def _of_paths(
    measured: Spectrum,
    wanted: tuple[str, ...],
    lines: RealArray,
    unit: str | tuple[str, ...],
    what: str,
) -> ComplexArray:
    """Values of the wanted channels on the given lines and in the given unit, or units of each."""
    if not np.array_equal(lines, measured.frequency):
        other = measured.frequency
        raise InputError(
            f"the {what} has other frequency lines ({other.size} from {other[0]:g} to "
            f"{other[-1]:g} Hz) than the rest ({lines.size} from {lines[0]:g} to "
            f"{lines[-1]:g} Hz): bring both to the same lines, nothing is interpolated here"
        )
    missing = [name for name in wanted if name not in measured.channels]
    if missing:
        raise InputError(f"no {what} of {missing}, there are {list(measured.channels)}")
    chosen = measured.select(wanted)
    expected = (unit,) * len(wanted) if isinstance(unit, str) else unit
    for seen, needed in zip(chosen.units, expected, strict=True):
        _refuse_other_unit(seen, needed, what)
    return chosen.values


def _refuse_other_unit(unit: str | tuple[str, ...], wanted: str, what: str) -> None:
    if unit != wanted:
        raise InputError(f"the {what} is in {unit}, expected {wanted}: convert it first")


@checked(relative_error="c", corr_f="c", corr_s="c", error_by_line="f")
class OnBoardValidation:
    """Predicted and measured response of sensors kept out of the inversion.

    - `relative_error` (n_channel,): norm of the difference over that of the measured response, over
      all lines [1].
    - `corr_f`, `corr_s` (n_channel,): difference in shape and in scale of the complex responses
      [1].
    - `error_by_line` (n_frequency,): norm of the difference over that of the measured response,
      over all channels [1].
    """

    predicted: Spectrum
    measured: Spectrum
    relative_error: RealArray
    corr_f: RealArray
    corr_s: RealArray
    error_by_line: RealArray


def validate_on_board(transfer: Frf, forces: PathForces, measured: Spectrum) -> OnBoardValidation:
    """Compare what forces predict at validation sensors with what was measured there.

    Close agreement is necessary, not proof: forces that a sensor hardly sees may be wrong. Raises
    InputError: a sensor that was an indicator of the inversion, was not measured or is silent.

    - `transfer`: validation sensors per force, one input per path; of the receiver in the state
      that goes with the forces.
    """
    used = [name for name in transfer.outputs if name in forces.indicators]
    if used:
        raise InputError(
            f"the sensors {used} were indicators of the inversion and agree by construction: "
            "validate with sensors that were kept out of it"
        )
    paths = forces.force.channels
    missing = [path for path in paths if path not in transfer.inputs]
    if missing:
        raise InputError(
            f"no transfer function of the paths {missing} to the validation sensors, there are "
            f"{list(transfer.inputs)}"
        )
    predicted = transfer.select(inputs=paths) @ forces.force
    if predicted.unit != measured.unit:
        raise InputError(
            f"forces predict {predicted.unit} at the validation sensors, which measured "
            f"{measured.unit}: convert one of them first"
        )
    kept = measured.select(transfer.outputs)
    if not np.array_equal(kept.frequency, predicted.frequency):
        raise InputError("the validation sensors and the forces have different frequency lines")
    size = np.linalg.norm(kept.values, axis=0)
    silent = [name for name, norm in zip(kept.channels, size, strict=True) if norm == 0]
    if silent:
        raise InputError(f"the validation sensors {silent} measured nothing: check their cables")
    difference = predicted.values - kept.values
    by_line = np.linalg.norm(kept.values, axis=1)
    return OnBoardValidation(
        predicted=predicted,
        measured=kept,
        relative_error=np.linalg.norm(difference, axis=0) / size,
        corr_f=corr_f(predicted.values, kept.values),
        corr_s=corr_s(predicted.values, kept.values),
        error_by_line=np.linalg.norm(difference, axis=1) / np.where(by_line > 0, by_line, 1.0),
    )
