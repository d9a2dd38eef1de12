"""Loads of an identified source at any speed, pressure by pressure."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from deboom.arrays import ComplexArray
from deboom.compressor.source_structure import gas_columns, rotor_columns

if TYPE_CHECKING:
    from deboom.compressor.sources import Sources

PASCAL_PER_BAR = 1e5


def case_name(pressure: float) -> str:
    """Name a pressure [Pa], such as ``7.5 bar``."""
    return f"{pressure / PASCAL_PER_BAR:g} bar"


def source_loads(found: Sources, frequency: npt.ArrayLike) -> dict[str, ComplexArray]:
    """Return what turns and what the gas does, as one load per pressure.

    Parameters
    ----------
    found : Sources
        From all speeds and pressures at once.
    frequency : array, shape (f,)
        Of the rotation [Hz].

    Returns
    -------
    dict of str to array, shape (f, 6)
        Such as ``7.5 bar`` → complex peak at the virtual point [N, N m].

    Notes
    -----
    Thesis, eq. 36 and 38: unbalances grow with ω² and are the same at every pressure, gas forces do
    neither.
    """
    rotor = rotor_columns(frequency, found.sense) @ np.array(
        [found.static.value, found.dynamic.value]
    )
    gas = gas_columns(found.sense)
    return {
        case_name(one.pressure): rotor
        + gas @ np.array([one.axial.value, one.moment.value, one.rotating.value])
        for one in found.gas
    }
