"""Pressure and level at the ears, line by line, of designs of the mounts."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from deboom.arrays import ComplexArray, RealArray
from deboom.errors import InputError
from deboom.physics import sound_level
from deboom.vehicles.fleet import Band, PathContributions


def checked_designs(designs: npt.ArrayLike, variable_names: Sequence[str]) -> RealArray:
    """Return designs as an array of one row per design, or say what is wrong with them.

    Parameters
    ----------
    designs : array_like, shape (n, n_variable)
        Stiffness factors [1].
    variable_names : sequence of str
        Name of each column.

    Returns
    -------
    array, shape (n, n_variable)

    Raises
    ------
    InputError
        Another shape, or a factor that is not finite.
    """
    rows = np.asarray(designs, dtype=float)
    if rows.ndim != 2 or rows.shape[1] != len(variable_names):
        raise InputError(
            f"designs of shape {rows.shape}: give one row per design with the "
            f"{len(variable_names)} factors {list(variable_names)}"
        )
    if not np.isfinite(rows).all():
        row, column = (int(index) for index in np.argwhere(~np.isfinite(rows))[0])
        raise InputError(
            f"design {row}: the factor of {variable_names[column]} is {rows[row, column]}, give a "
            "finite number"
        )
    return rows


def path_pressures(contributions: PathContributions, designs: npt.ArrayLike) -> ComplexArray:
    """Return the pressure by design variable, kept complex: paths cancel.

    Parameters
    ----------
    contributions : PathContributions
        Per unit stiffness factor.
    designs : array_like, shape (n_design, n_variable)
        Stiffness factors [1].

    Returns
    -------
    array, shape (n_design, n_vehicle, n_frequency, n_variable)
        ``C_vfk x_dk`` [Pa].
    """
    factors = checked_designs(designs, contributions.variable_names)
    return np.asarray(factors[:, np.newaxis, np.newaxis, :] * contributions.values)


def pressure(contributions: PathContributions, designs: npt.ArrayLike) -> ComplexArray:
    """Return the pressure at the ears.

    Parameters
    ----------
    contributions : PathContributions
        Per unit stiffness factor.
    designs : array_like, shape (n_design, n_variable)
        Stiffness factors [1].

    Returns
    -------
    array, shape (n_design, n_vehicle, n_frequency)
        Complex peak amplitudes ``Σ_k C_vfk x_dk`` [Pa].

    Notes
    -----
    Thesis, eq. 12 and 13.
    """
    factors = checked_designs(designs, contributions.variable_names)
    return np.asarray(np.einsum("vfk,dk->dvf", contributions.values, factors))


def levels(contributions: PathContributions, designs: npt.ArrayLike) -> RealArray:
    """Return the sound pressure level of every line.

    Parameters
    ----------
    contributions : PathContributions
        Per unit stiffness factor.
    designs : array_like, shape (n_design, n_variable)
        Stiffness factors [1].

    Returns
    -------
    array, shape (n_design, n_vehicle, n_frequency)
        [dB(A)].
    """
    return sound_level.spl(pressure(contributions, designs), contributions.frequency, axis=-1)


def mean_energy_level(level: npt.ArrayLike, frequency: npt.ArrayLike, band: Band) -> RealArray:
    """Return the level of the mean energy of the lines of a band.

    Parameters
    ----------
    level : array_like, shape (..., n_frequency)
        Of the lines [dB(A)].
    frequency : array_like, shape (n_frequency,)
        Of the lines [Hz].
    band : (lower, upper)
        Both edges belong to the band, such as 25 and 40 Hz [Hz].

    Returns
    -------
    array, shape (...)
        ``10 lg mean 10^(L/10)`` [dB(A)].

    Raises
    ------
    InputError
        A band without a line, or a frequency axis of another length than `level` has.

    Notes
    -----
    The loud lines rule it, whereas SPLV counts every line alike. The mean instead of the sum makes
    it independent of the spacing of the lines.
    """
    lines = np.asarray(frequency, dtype=float)
    energy = sound_level.band_energy_level(level, lines, band, axis=-1)
    n_lines = np.count_nonzero((lines >= band[0]) & (lines <= band[1]))
    return np.asarray(energy - 10.0 * np.log10(n_lines))
