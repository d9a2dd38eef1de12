"""The true compressor of the virtual bench: mass, mounts, rubber, and what carries them.

Everything here is the bench's own: it shares the equations of `physics` with the identification
and nothing else.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from deboom.arrays import ComplexArray, RealArray
from deboom.bench.compressor_plan import COMPRESSOR_DATA, CompressorCase, CompressorPlan
from deboom.bench.frozen import freeze_arrays
from deboom.bench.hoses import Hose, held_stiffness, true_hoses
from deboom.bench.parameters import read_data
from deboom.physics.rigid_body import (
    forward_matrices,
    mass_matrix,
    mount_stiffness_matrix,
    rotation_matrix,
)


@dataclass(frozen=True)
class Softening:
    """How a mount softens: ``1 + β (1/(1 + s/s_c) − 1/(1 + s_h/s_c))`` over its amplitude s.

    Parameters
    ----------
    share : float
        β, from rest to large amplitudes [1].
    scale : float
        s_c [m].
    reference : float
        s_h, at which the factor is 1: the amplitude of a usual hit [m].
    """

    share: float
    scale: float
    reference: float

    def factor(self, amplitude: RealArray) -> RealArray:
        """Factor on the dynamic stiffness at each amplitude [m]."""
        at_reference = 1 / (1 + self.reference / self.scale)
        return np.asarray(1 + self.share * (1 / (1 + amplitude / self.scale) - at_reference))


@dataclass(frozen=True)
class Receiver:
    """What carries each mount along each of its axes: one mode and a residual compliance.

    Parameters
    ----------
    frequency : float
        Of the mode [Hz].
    mass : float
        Modal [kg].
    loss : float
        Of the mode [1].
    residual : float
        Stiffness of all that lies above [N/m].
    residual_loss : float
        [1]
    """

    frequency: float
    mass: float
    loss: float
    residual: float
    residual_loss: float

    def receptance(self, frequency: RealArray) -> ComplexArray:
        """Displacement per force, shape (f,) [m/N]."""
        squared = (2 * np.pi * np.asarray(frequency)) ** 2
        natural = (2 * np.pi * self.frequency) ** 2 * (1 + 1j * self.loss)
        return np.asarray(
            1 / (self.residual * (1 + 1j * self.residual_loss))
            + 1 / (self.mass * (natural - squared))
        )


@dataclass(frozen=True)
class Joint:
    """What joins the two parts of a body that is not rigid.

    Parameters
    ----------
    frequency : float
        At which the parts swing against each other, in all six ways [Hz].
    share : float
        Of the second part in the mass matrix of the whole; it lies at x > 0 [1].
    loss : float
        [1]

    Notes
    -----
    Both parts have a share of the mass matrix M of the whole, and the joint is ``(2π f)² μ (1 − μ)
    M (1 + jη)``: together they weigh M, and all six relative modes of the free body lie at f.
    """

    frequency: float
    share: float = 0.5
    loss: float = 0.02


@dataclass(frozen=True, eq=False)
class Compressor:
    """A compressor on its mounts, as it truly is; the virtual point is the origin.

    Parameters
    ----------
    mass : float
        [kg]
    centre : array, shape (3,)
        Of gravity [m].
    inertia : array, shape (3, 3)
        About the centre of gravity [kg m²].
    positions : array, shape (n_mount, 3)
        Of the mounts [m].
    rotations : array, shape (n_mount, 3)
        Of the mounts about the fixed axes x, then y, then z [rad]; local x is axial.
    stiffness : array, shape (n_mount, 3)
        Static, axial and two radial [N/m].
    gain : array, shape (6,)
        Real limit, slope, offset, imaginary limit, slope, offset of the dynamic gain.
    softening : Softening or None
        None where the amplitude does not matter.
    receiver : Receiver or None
        None where the ground is rigid.
    joint : Joint or None
        None where the body is rigid.
    hoses : tuple of Hose
        Whose other ends are held; a body with hoses is rigid.
    """

    mass: float
    centre: RealArray
    inertia: RealArray
    positions: RealArray
    rotations: RealArray
    stiffness: RealArray
    gain: RealArray
    softening: Softening | None = None
    receiver: Receiver | None = None
    joint: Joint | None = None
    hoses: tuple[Hose, ...] = ()

    def __post_init__(self) -> None:
        freeze_arrays(self)

    @property
    def mass_matrix(self) -> RealArray:
        """At the virtual point, shape (6, 6) [kg, kg m, kg m²]."""
        return mass_matrix(self.mass, self.inertia, self.centre)

    @property
    def static_stiffness(self) -> RealArray:
        """At the virtual point on rigid ground, shape (6, 6) [N/m, N/rad, N m/rad]."""
        orientations = rotation_matrix(self.rotations)
        return np.asarray(
            mount_stiffness_matrix(self.positions, self.stiffness, orientations), dtype=float
        )

    def gain_at(self, frequency: RealArray) -> ComplexArray:
        """Dynamic over static stiffness, ``v∞ − 1/(m f + w₀)`` in both parts, shape (f,) [1]."""
        limits, slopes, offsets = self.gain.reshape(2, 3).T
        parts = limits - 1 / (np.multiply.outer(frequency, slopes) + offsets)
        return np.asarray(parts @ [1, 1j])

    def mount_stiffness(
        self, frequency: RealArray, factors: RealArray | None = None
    ) -> ComplexArray:
        """Dynamic stiffness of the mounts with their receiver at the virtual point.

        Parameters
        ----------
        frequency : array, shape (f,)
            [Hz].
        factors : array, shape (n_mount,) or (f, n_mount), optional
            Of softening; by default 1.

        Returns
        -------
        array, shape (f, 6, 6)
            [N/m, N/rad, N m/rad].
        """
        factors = np.ones(len(self.positions)) if factors is None else factors
        own = self.gain_at(frequency)[:, None, None] * (factors[..., None] * self.stiffness)
        if self.receiver is not None:
            # mount and receiver carry one force: their compliances add
            own = own / (1 + own * self.receiver.receptance(frequency)[:, None, None])
        orientations = rotation_matrix(self.rotations)
        return np.asarray(mount_stiffness_matrix(self.positions, own, orientations))

    def dynamic_stiffness(
        self, frequency: RealArray, factors: RealArray | None = None
    ) -> ComplexArray:
        """Force per displacement of the body, or of both of its parts.

        Parameters
        ----------
        frequency : array, shape (f,)
            From 0 [Hz].
        factors : array, shape (n_mount,) or (f, n_mount), optional
            Of softening; by default 1.

        Returns
        -------
        array, shape (f, 6, 6), or (f, 12, 12) for a body of two parts
            The mounts hold the first part [N/m, N/rad, N m/rad].
        """
        whole, mounts = self.mass_matrix, self.mount_stiffness(frequency, factors)
        held = mounts + held_stiffness(self.hoses, frequency)
        squared = ((2 * np.pi * np.asarray(frequency)) ** 2)[:, None, None]
        if self.joint is None:
            return np.asarray(held - squared * whole)
        share = self.joint.share
        complex_square = (2 * np.pi * self.joint.frequency) ** 2 * (1 + 1j * self.joint.loss)
        joined = complex_square * share * (1 - share) * whole
        both = np.empty((len(squared), 12, 12), dtype=complex)
        both[:, :6, :6] = held + joined - squared * (1 - share) * whole
        both[:, 6:, 6:] = joined - squared * share * whole
        both[:, :6, 6:] = both[:, 6:, :6] = -joined
        return both

    def inertance(self, frequency: RealArray, factors: RealArray | None = None) -> ComplexArray:
        """Acceleration per force, of the shape of `dynamic_stiffness` [1/kg, …]; 0 at 0 Hz."""
        squared = ((2 * np.pi * np.asarray(frequency)) ** 2)[:, None, None]
        return np.asarray(-squared * np.linalg.inv(self.dynamic_stiffness(frequency, factors)))

    def on_parts(self, rows: RealArray, positions: RealArray) -> RealArray:
        """Put rows of a rigid body on the part of the body where each point lies.

        Parameters
        ----------
        rows : array, shape (n, 6)
            Motion of the body → motion of one point each, along one direction [1, m].
        positions : array, shape (n, 3)
            Of the points [m].

        Returns
        -------
        array, shape (n, 6), or (n, 12) for a body of two parts
        """
        if self.joint is None:
            return rows
        second = (positions[:, :1] > 0).astype(float)
        return np.hstack([(1 - second) * rows, second * rows])

    @property
    def mount_rows(self) -> RealArray:
        """Motion of the body to that of the mounts, three rows each, along fixed axes."""
        rows = forward_matrices(self.positions)
        return rows if self.joint is None else np.hstack([rows, np.zeros_like(rows)])


def true_compressor(plan: CompressorPlan, generator: np.random.Generator) -> Compressor:
    """Return the compressor that a plan asks for.

    Parameters
    ----------
    plan : CompressorPlan
        Which one.
    generator : Generator
        Draws a random case: uniform around table 10, the gain around its true values; then the
        hoses.
    """
    data = read_data(COMPRESSOR_DATA)
    case = _table_11(data) if plan.case is CompressorCase.TABLE11 else _random(data, generator)
    stiffness = case["stiffness"]
    if plan.identical_mounts:
        axial, radial = stiffness[:, 0].mean(), stiffness[:, 1:].mean()
        stiffness = np.tile([axial, radial, radial], (len(stiffness), 1))
    operation = data["operation"]
    law, carried = operation["amplitude_law"], operation["flexible_receiver"]
    return Compressor(
        **(case | {"stiffness": stiffness}),
        softening=Softening(law["beta"], law["s_c_m"], law["s_hammer_m"])
        if plan.softening
        else None,
        receiver=Receiver(
            carried["mode_Hz"],
            carried["modal_mass_kg"],
            carried["loss"],
            carried["residual_stiffness_N_per_m"],
            carried["residual_loss"],
        )
        if plan.flexible_receiver
        else None,
        joint=Joint(plan.flexible_body) if plan.flexible_body else None,
        hoses=true_hoses(plan.hoses, generator) if plan.hoses else (),
    )


def inertia_tensor(elements: RealArray) -> RealArray:
    """Return the tensor of xx, yy, zz, xy, xz, yz, products with their sign, shape (3, 3)."""
    xx, yy, zz, xy, xz, yz = elements
    return np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])


def _table_11(data: dict[str, Any]) -> dict[str, Any]:
    truth = data["truth"]
    return {
        "mass": truth["mass_kg"],
        "centre": np.array(truth["centre_of_gravity_m"]),
        "inertia": inertia_tensor(np.array(truth["inertia_about_cog_kg_m2_xx_yy_zz_xy_xz_yz"])),
        "positions": np.array(truth["mount_position_m"]),
        "rotations": np.deg2rad(truth["mount_rotation_deg"]),
        "stiffness": np.array(truth["mount_static_stiffness_N_per_m_axial_radial1_radial2"]),
        "gain": _gain(truth),
    }


def _random(data: dict[str, Any], generator: np.random.Generator) -> dict[str, Any]:
    start, spread = data["start_table10"], data["random_case_spread"]

    def around(value: object, width: float, relative: bool = False) -> RealArray:
        middle = np.array(value, dtype=float)
        deviation = width * generator.uniform(-1, 1, middle.shape)
        return np.asarray(middle * (1 + deviation) if relative else middle + deviation)

    elements = np.array(start["inertia_kg_m2_xx_yy_zz_xy_xz_yz"])
    return {
        "mass": float(around(start["mass_kg"], spread["mass_kg"])),
        "centre": around(np.zeros(3), spread["centre_of_gravity_m"]),
        "inertia": inertia_tensor(
            np.concatenate(
                [
                    around(elements[:3], spread["inertia_relative"], relative=True),
                    around(elements[3:], spread["inertia_products_kg_m2"]),
                ]
            )
        ),
        "positions": around(start["mount_position_m"], spread["position_m"]),
        "rotations": np.deg2rad(around(start["mount_rotation_deg"], spread["rotation_deg"])),
        "stiffness": around(
            start["mount_static_stiffness_N_per_m_axial_radial1_radial2"],
            spread["stiffness_relative"],
            relative=True,
        ),
        "gain": around(_gain(data["truth"]), spread["gain_relative"], relative=True),
    }


def _gain(truth: dict[str, Any]) -> RealArray:
    return np.array([*truth["gain_real_vinf_m_w0"], *truth["gain_imag_vinf_m_w0"]])
