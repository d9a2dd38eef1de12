"""How a running compressor moves as a rigid body, and how well its accelerometers agree on it."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from deboom.measurement.channels import Spectrum
from deboom.measurement.consistency import RigidConsistency, response_consistency
from deboom.measurement.virtual_point import VirtualPoint, motion_at_point

if TYPE_CHECKING:
    from deboom.compressor.self_calibration import SelfCalibration
    from deboom.measurement.operating_sweep import OperatingSweep


@dataclass(frozen=True, eq=False)
class OperatingMotion:
    """Motion of the virtual point over the speed of one sweep.

    Parameters
    ----------
    sweep : str
        Name of the sweep.
    by_sheet, calibrated : Spectrum
        Channels ``x y z rx ry rz``, with the sensors where the position sheet has them and where
        the hammer test found them [m/s², rad/s²].
    consistency_by_sheet, consistency_calibrated : RigidConsistency
        Of the channels with that motion.
    """

    sweep: str
    by_sheet: Spectrum
    calibrated: Spectrum
    consistency_by_sheet: RigidConsistency
    consistency_calibrated: RigidConsistency


def operating_motion(
    sweep: OperatingSweep, sheet: VirtualPoint, calibrated: SelfCalibration
) -> OperatingMotion:
    """Project the channels of a sweep on the motions of a rigid body.

    Parameters
    ----------
    sweep : OperatingSweep
    sheet : VirtualPoint
        Of its accelerometers, as the position sheet has them.
    calibrated : SelfCalibration
        Gains, places and angles that the hammer test revealed.

    Returns
    -------
    OperatingMotion

    Raises
    ------
    InputError
        Channels of other sensors, or a line without any signal.

    Notes
    -----
    Thesis, eq. 27 and figure 52. A consistency that rises with the calibration shows that the
    errors were those of the sheet and not a body that bends.
    """
    forward = calibrated.placement.response_matrix(calibrated.errors)
    found = replace(
        sheet, forward=forward, inverse=np.asarray(np.linalg.pinv(forward), dtype=float)
    )
    measured = sweep.acceleration
    return OperatingMotion(
        sweep.name,
        motion_at_point(sheet, measured),
        motion_at_point(found, measured),
        response_consistency(sheet, measured),
        response_consistency(found, measured),
    )
