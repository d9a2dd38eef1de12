"""Self-calibration from the mass line alone, where no foundation can disturb it."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from deboom.compressor.identify import ALARM, GAIN_DEVIATION
from deboom.compressor.linear_start import START_GAIN
from deboom.compressor.minimal_parameters import N_MASS, N_STIFFNESS
from deboom.compressor.self_calibration import (
    Prior,
    SelfCalibration,
    WeighedMass,
    self_calibrate,
)
from deboom.errors import InputError

if TYPE_CHECKING:
    from deboom.compressor.identify import Identification

MASS_LINE = 60.0
"""Where the load of the mounts has fallen to some percent of the body's inertia [Hz]."""
SMALLEST_LINES = 12
LARGEST_LINES = 48
STIFFNESS_DEVIATION = 0.3
"""Of each entry of K_VP over its own size or that of the diagonal: what 60 Hz leave open [1]."""


def calibration_of(found: Identification, above: float = MASS_LINE) -> SelfCalibration:
    """Choose the calibration of sensors and impacts that can be trusted.

    Parameters
    ----------
    found : Identification
    above : float
        First line of the mass line [Hz].

    Returns
    -------
    SelfCalibration
        That of the identification; where its model of mounts on rigid ground raised its alarm, one
        from the lines above alone, in which mounts and ground hardly take part.

    Raises
    ------
    InputError
        An alarm, and too few lines above.

    Notes
    -----
    A subframe's resonance that the model does not know is otherwise explained by sensors out of
    place, and that error goes into every load.
    """
    if max([found.calibrated.reduced_chi, *(one.reduced_chi for one in found.held_out)]) <= ALARM:
        return found.calibrated
    lines = np.flatnonzero(found.raw.frf.frequency >= above)
    if lines.size < SMALLEST_LINES:
        raise InputError(
            f"{found.test.name}: mounts on rigid ground do not explain the hammer test, and only "
            f"{lines.size} of its lines lie above {above:g} Hz, where they hardly matter: measure "
            "up to 150 Hz"
        )
    if lines.size > LARGEST_LINES:
        lines = lines[np.round(np.linspace(0, lines.size - 1, LARGEST_LINES)).astype(int)]
    marked = np.zeros(found.raw.frf.frequency.size, dtype=bool)
    marked[lines] = True
    parametrisation, start = found.calibrated.parametrisation, found.point.values
    free = N_MASS + N_STIFFNESS
    prior = Prior(
        np.concatenate([start[:free], START_GAIN]),
        np.concatenate(
            [
                np.full(N_MASS, np.inf),
                np.maximum(np.abs(start[N_MASS:free]), 1.0) * STIFFNESS_DEVIATION,
                GAIN_DEVIATION,
            ]
        ),
    )
    weighed = found.test.weighed_mass
    return self_calibrate(
        parametrisation,
        found.raw.select(marked),
        found.test.tolerances,
        start,
        weighed=None
        if weighed is None
        else WeighedMass(weighed, found.test.weighed_mass_deviation),
        prior=prior,
    )
