"""Dynamic stiffness of a straight uniform viscoelastic beam, exact at every frequency.

End motions are stacked ``(x, y, z, rx, ry, rz)`` of the first end, then of the second; loads are
those that act on the beam, so that a beam pushes back on what holds it with the negative of them.
"""

from __future__ import annotations

from typing import Any, TypeAlias

import numpy as np
import numpy.typing as npt

from deboom.arrays import ComplexArray, RealArray, checked
from deboom.errors import InputError
from deboom.physics.rigid_body import shift_matrix

SERIES_BELOW = 0.1
"""Bending wave number times length below which the closed form loses digits to cancellation."""
Number: TypeAlias = Any
"""A float, or an array (..., 1) where many beams are computed at once."""
LARGEST_BENDING = 50.0
"""Bending wave number times length above which the hyperbolic functions are worth nothing."""


@checked(">0 <inf")
class ViscoelasticBeam:
    """Straight uniform beam of a round section, one complex modulus; all numbers are positive.

    - `length` [m], `line_mass` [kg/m].
    - `tension` EA [N], `torsion` GJ [N m²], `bending` EI [N m²]: real parts.
    - `loss_factor` η of all three [1].
    - `torsion_radius`: radius of gyration of the section about its axis [m].
    """

    length: Number
    tension: Number
    torsion: Number
    bending: Number
    line_mass: Number
    loss_factor: Number
    torsion_radius: Number


def beam_stiffness(beam: ViscoelasticBeam, frequency: npt.ArrayLike) -> ComplexArray:
    """Return the dynamic stiffness (..., n_frequency, 12, 12) between the ends, in the beam's axes.

    Loads on the ends per motion of the ends; local x runs from the first end to the second;
    symmetric [N/m, N/rad, N m/rad]. Raises InputError: a line at or below 0 Hz, or so high that the
    bending waves are shorter than an eighth of the length.

    Notes
    -----
    Spectral element of a bar, a shaft and a Euler-Bernoulli beam with the complex moduli
    ``E(1 + jη)``, ``G(1 + jη)`` (Doyle, Wave Propagation in Structures, 2nd ed., ch. 2 and 3;
    Koloušek, Dynamics in Engineering Structures, 1973). With ``X = EA(1 + jη)``, ``μ`` per length
    and ``x = ωL√(μ/X)`` the bar is ``X/L [[x cot x, −x/sin x], [−x/sin x, x cot x]]``, the shaft
    the same with GJ and ``μ r²``; in bending ``x⁴ = μω²L⁴/EI(1 + jη)`` and the entries are those of
    `_bending`. No mesh and no truncation: one element holds all modes.

    Valid for waves much longer than the hose is thick: shear, rotatory inertia, curvature, static
    tension, flow and inner pressure are not in it.
    """
    lines = np.asarray(frequency, dtype=float)
    if lines.ndim != 1 or not np.all(lines > 0):
        raise InputError("a beam needs lines above 0 Hz: its mass has no static counterpart")
    omega = 2 * np.pi * lines
    modulus = 1 + 1j * beam.loss_factor
    shaft_mass = beam.line_mass * beam.torsion_radius**2
    rigidity = beam.bending * modulus
    waves = np.asarray((beam.line_mass * omega**2 / rigidity) ** 0.25 * beam.length)
    matrix = np.zeros((*waves.shape, 12, 12), dtype=complex)
    for dof, real, mass in ((0, beam.tension, beam.line_mass), (3, beam.torsion, shaft_mass)):
        x = omega * beam.length * np.sqrt(mass / (real * modulus))
        scale = real * modulus / beam.length
        ends = scale * x * np.cos(x) / np.sin(x)
        matrix[..., dof, dof] = matrix[..., dof + 6, dof + 6] = ends
        matrix[..., dof, dof + 6] = matrix[..., dof + 6, dof] = -scale * x / np.sin(x)
    size = np.asarray(beam.length)[..., np.newaxis] ** np.array([3, 2, 1, 3, 2, 1])
    values = _bending(waves) * np.asarray(rigidity)[..., np.newaxis] / size
    for shift, turn, sign in ((1, 5, 1.0), (2, 4, -1.0)):
        for row, column, entry, factor in (
            (shift, shift, 0, 1.0),
            (shift + 6, shift + 6, 0, 1.0),
            (shift, turn, 1, sign),
            (shift + 6, turn + 6, 1, -sign),
            (turn, turn, 2, 1.0),
            (turn + 6, turn + 6, 2, 1.0),
            (shift, shift + 6, 3, 1.0),
            (shift, turn + 6, 4, sign),
            (turn, shift + 6, 4, -sign),
            (turn, turn + 6, 5, 1.0),
        ):
            matrix[..., row, column] = matrix[..., column, row] = factor * values[..., entry]
    return matrix


def frame_along(direction: npt.ArrayLike) -> RealArray:
    """Return right-handed axes of a beam, the same ones for the same direction.

    - `direction` (..., 3).
    - returns (..., 3, 3): columns are the local axes: x along the beam, y level (normal to the
      global z), or the global y for a beam along z [1].
    """
    axis = np.asarray(direction, dtype=float)
    norm = np.linalg.norm(axis, axis=-1, keepdims=True)
    if axis.shape[-1] != 3 or not np.all(np.isfinite(norm) & (norm > 0)):
        raise InputError("a beam needs a direction of three numbers that are not all zero")
    axis = axis / norm
    level = np.stack([-axis[..., 1], axis[..., 0], np.zeros(axis.shape[:-1])], axis=-1)
    # along z every transverse direction is level: y is taken, for there is no limit
    level[np.linalg.norm(level, axis=-1) <= 1e-9] = [0.0, 1.0, 0.0]
    level /= np.linalg.norm(level, axis=-1, keepdims=True)
    return np.stack([axis, level, np.cross(axis, level)], axis=-1)


def beam_congruence(
    frame: npt.ArrayLike,
    first: npt.ArrayLike = (0.0, 0.0, 0.0),
    second: npt.ArrayLike = (0.0, 0.0, 0.0),
) -> RealArray:
    """Return the congruence from the motion of two points to that of the ends of a beam, (12, 12).

    Parameters
    ----------
    frame : array, shape (3, 3) — axes of the beam from `frame_along`
    first, second : array, shape (3,)
        Ends, each from the point of the body that holds it, such as a virtual point [m].

    Notes
    -----
    ``G = diag(Rᵀ, Rᵀ) [[I, skew(r)ᵀ], [0, I]]`` for each end: all six motions of the point, not
    only the three of a mount. The stiffness seen at the points is ``Gᵀ K G``.
    """
    turned = np.asarray(frame, dtype=float).T
    turn = np.kron(np.eye(2), turned)
    matrix = np.zeros((12, 12))
    matrix[:6, :6] = turn @ shift_matrix(-np.asarray(first, dtype=float))
    matrix[6:, 6:] = turn @ shift_matrix(-np.asarray(second, dtype=float))
    return matrix


def _bending(x: ComplexArray) -> ComplexArray:
    """Six entries of a bent beam over EI/Lⁿ, shape (..., n_frequency, 6).

    Own force per shift, own force per turn (= moment per shift), own moment per turn, then the
    three that act at one end for a motion of the other.
    """
    if np.abs(x).max() > LARGEST_BENDING:
        raise InputError(
            "the bending waves of the beam are shorter than an eighth of its length: it is too "
            "long, heavy or limp for these frequencies to be one beam"
        )
    # below, the first two terms of the series: static stiffness and consistent mass
    small = np.abs(x) < SERIES_BELOW
    static = np.array([12.0, 6.0, 4.0, -12.0, 6.0, 2.0])
    mass = np.array([156.0, 22.0, 4.0, 54.0, -13.0, -3.0]) / 420.0
    series = static - mass * x[..., np.newaxis] ** 4
    x = np.where(small, 1.0, x)
    s, c, sh, ch = np.sin(x), np.cos(x), np.sinh(x), np.cosh(x)
    tops = (
        x**3 * (s * ch + c * sh),
        x**2 * s * sh,
        x * (s * ch - c * sh),
        -(x**3) * (s + sh),
        x**2 * (ch - c),
        x * (sh - s),
    )
    entries = np.stack(tops, axis=-1) / (1 - c * ch)[..., np.newaxis]
    return np.where(small[..., np.newaxis], series, entries)
