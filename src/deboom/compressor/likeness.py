"""How alike measured and identified FRFs and mode shapes are."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from deboom.arrays import RealArray
from deboom.compressor.modes import ModalTable, modal_table
from deboom.compressor.objectives import in_bands
from deboom.physics.correlation import mac

if TYPE_CHECKING:
    from deboom.compressor.identify import Identification


def frac(
    measured: npt.ArrayLike,
    identified: npt.ArrayLike,
    frequency: npt.ArrayLike,
    band: tuple[float, float],
) -> RealArray:
    """Frequency response assurance criterion of each entry in a band.

    Parameters
    ----------
    measured, identified : array, shape (n_frequency, 6, 6)
        Inertance or apparent mass, each in its SI units.
    frequency : array, shape (n_frequency,)
        [Hz].
    band : (float, float)
        From, to, both included [Hz].

    Returns
    -------
    array, shape (6, 6)
        From 0 to 1, which is one curve up to a factor [1].

    Notes
    -----
    It stands where the thesis's figure 55b compares "eigenvectors" in 100-150 Hz, a band that has
    no modes.
    """
    lines = in_bands(frequency, (band,))
    return mac(np.asarray(measured)[lines], np.asarray(identified)[lines])


def measured_modes(found: Identification) -> ModalTable:
    """Modes of the linear estimate of mass and stiffness, which knows no calibration.

    Parameters
    ----------
    found : Identification

    Returns
    -------
    ModalTable
        Of a direct parameter estimation from the inertance as the position sheet has it; only the
        gain, whose shape a linear estimate cannot give, is the identified one.

    Raises
    ------
    InputError
        A linear estimate with a negative stiffness.
    """
    parametrisation = found.point.parametrisation
    own = np.concatenate([found.start[:-5], found.point.values[-5:]])
    return modal_table(parametrisation.model(own))


def modal_likeness(found: Identification) -> RealArray:
    """MAC of measured (rows) and identified (columns) mode shapes at the accelerometers.

    Parameters
    ----------
    found : Identification

    Returns
    -------
    array, shape (6, 6)
        [1]. At the channels, translations and rotations have one unit.
    """
    measured = found.response.forward @ measured_modes(found).shapes
    identified = found.response.forward @ found.modes.shapes
    return mac(measured[:, :, np.newaxis], identified[:, np.newaxis, :])
