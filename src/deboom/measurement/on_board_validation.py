"""On-board validation: do forces explain responses that took no part in finding them?"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from deboom.arrays import RealArray
from deboom.errors import InputError
from deboom.measurement.channels import Frf, Spectrum
from deboom.measurement.path_forces import PathForces
from deboom.physics.correlation import corr_f, corr_s


@dataclass(frozen=True, eq=False)
class OnBoardValidation:
    """Predicted and measured response of sensors kept out of the inversion.

    Parameters
    ----------
    predicted, measured : Spectrum
        Same lines and channels.
    relative_error : array, shape (n_channel,)
        Norm of the difference over that of the measured response, over all lines [1].
    corr_f, corr_s : array, shape (n_channel,)
        Difference in shape and in scale of the complex responses [1].
    error_by_line : array, shape (n_frequency,)
        Norm of the difference over that of the measured response, over all channels [1].
    """

    predicted: Spectrum
    measured: Spectrum
    relative_error: RealArray
    corr_f: RealArray
    corr_s: RealArray
    error_by_line: RealArray

    def __post_init__(self) -> None:
        for name in ("relative_error", "corr_f", "corr_s", "error_by_line"):
            array = np.array(getattr(self, name), dtype=float)
            array.setflags(write=False)
            object.__setattr__(self, name, array)


def validate_on_board(transfer: Frf, forces: PathForces, measured: Spectrum) -> OnBoardValidation:
    """Compare what forces predict at validation sensors with what was measured there.

    Parameters
    ----------
    transfer : Frf
        Validation sensors per force, one input per path; of the receiver in the state that goes
        with the forces.
    forces : PathForces
        To be judged.
    measured : Spectrum
        The same sensors in operation; further channels are not looked at.

    Raises
    ------
    InputError
        A sensor that was an indicator of the inversion, one that was not measured or is silent,
        paths, lines or units that differ.

    Notes
    -----
    Close agreement is necessary, not proof: forces that a sensor hardly sees may be wrong.
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
    silent = [
        name
        for name, column in zip(kept.channels, kept.values.T, strict=True)
        if not np.any(column)
    ]
    if silent:
        raise InputError(f"the validation sensors {silent} measured nothing: check their cables")
    difference = predicted.values - kept.values
    by_line = np.linalg.norm(kept.values, axis=1)
    return OnBoardValidation(
        predicted=predicted,
        measured=kept,
        relative_error=np.linalg.norm(difference, axis=0) / np.linalg.norm(kept.values, axis=0),
        corr_f=corr_f(predicted.values, kept.values),
        corr_s=corr_s(predicted.values, kept.values),
        error_by_line=np.linalg.norm(difference, axis=1) / np.where(by_line > 0, by_line, 1.0),
    )
