"""The true compressor on its mounts and hoses, and the plan that asks for it.

Everything here is the bench's own: it shares the equations of `physics` with the identification and
nothing else.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any

import numpy as np

from deboom.arrays import ComplexArray, RealArray, checked
from deboom.bench.choices import CompressorCase, HoseCase
from deboom.bench.powertrain import read_data
from deboom.physics.rigid_body import (
    forward_matrices,
    mass_matrix,
    mount_stiffness_matrix,
    rotation_matrix,
)
from deboom.physics.viscoelastic_beam import (
    ViscoelasticBeam,
    beam_congruence,
    beam_stiffness,
    frame_along,
)

COMPRESSOR_DATA = "compressor.json"
"""The bench's frozen data of compressor, rig, operation and hoses."""

HOSE_NAMES = ("suction hose", "discharge hose")

SCATTER = (0.75, 1.3)
"""Least and largest stiffness, mass and loss of a scattered hose over the drawn ones [1]."""

PORT_OFFSET, LEAN, LENGTH_SPREAD = 4e-3, 0.09, 0.04
"""Half widths of a displaced hose: port per axis [m], direction per axis [1], length [1]."""


@checked(flexible_body=">=0 <inf")
class CompressorPlan:
    """The compressor under test and what is recorded of it.

    - `case`: source of its true parameters.
    - `identical_mounts`: whether all mounts share one axial and one radial stiffness.
    - `softening`: mounts soften with their amplitude; each hit meets mounts of its own.
    - `flexible_receiver`: a subframe with a mode inside the band carries the mounts.
    - `flexible_body`: the compressor is two parts that swing against each other at this frequency;
      0 is rigid [Hz].
    - `free`: it hangs from cords, ten thousand times softer than its mounts.
    - `hits`: write the blocks over time as well.
    - `hoses`: hoses joined to it; None for none.
    - raises InputError: a frequency of the body that is negative or not finite.
    """

    case: CompressorCase = CompressorCase.RANDOM
    identical_mounts: bool = False
    softening: bool = False
    flexible_receiver: bool = False
    flexible_body: float = 0.0
    hits: bool = False
    free: bool = False
    hoses: HoseCase | None = None


@dataclass(frozen=True, eq=False)
class Hose:
    """A straight viscoelastic beam from its port outwards.

    - `name`: name, such as ``suction hose``.
    - `position` (3,): port on the compressor, from the virtual point [m].
    - `direction` (3,): unit vector from the port to the body [1].
    - `beam`: the beam.
    """

    name: str
    position: RealArray
    direction: RealArray
    beam: ViscoelasticBeam

    @property
    def end(self) -> RealArray:
        """Place of the end on the body, from the virtual point, shape (3,) [m]."""
        return np.asarray(self.position + self.beam.length * self.direction)

    def stiffness(self, frequency: RealArray) -> ComplexArray:
        """Return loads on the hose per motion of virtual point and body end, in the fixed axes.

        - returns (f, 12, 12): six degrees of freedom of the compressor at the virtual point, six of
          the body at the end of the hose [N/m, N/rad, N m/rad]; at 0 Hz the value at a millihertz.
        """
        # a spectral element is a quotient of zeros at 0 Hz
        lines = np.maximum(np.asarray(frequency, dtype=float), 1e-3)
        seen = beam_congruence(frame_along(self.direction), self.position)
        return np.asarray(seen.T @ beam_stiffness(self.beam, lines) @ seen)


def held_stiffness(hoses: Sequence[Hose], frequency: RealArray) -> ComplexArray:
    """Return the stiffness at the virtual point of hoses whose other ends are held, (f, 6, 6)."""
    lines = np.asarray(frequency, dtype=float)
    if not hoses:
        return np.zeros((lines.size, 6, 6), dtype=complex)
    return _held_stiffness(tuple(hoses), lines.tobytes())


# whoever lets mounts soften asks for the same lines a thousand times
@lru_cache(maxsize=4)
def _held_stiffness(hoses: tuple[Hose, ...], lines: bytes) -> ComplexArray:
    """Return `held_stiffness`, remembered."""
    total = np.sum([hose.stiffness(np.frombuffer(lines))[:, :6, :6] for hose in hoses], axis=0)
    total.setflags(write=False)
    return np.asarray(total)


def end_loads(hoses: Sequence[Hose], frequency: RealArray) -> ComplexArray:
    """Return loads of hoses on what holds their ends, per motion of the virtual point.

    Force and moment on the body at the end of each hose, (f, 6 n_hose, 6) [N/m, N/rad, N m/rad].
    """
    return -np.concatenate([hose.stiffness(frequency)[:, 6:, :6] for hose in hoses], axis=1)


def drawn_hoses() -> tuple[Hose, ...]:
    """Return the hoses of the frozen data."""
    return tuple(
        Hose(
            name,
            np.array(hose["port_position_m"]),
            np.array(hose["direction"]) / np.linalg.norm(hose["direction"]),
            ViscoelasticBeam(
                length=hose["length_m"],
                tension=hose["EA_N"],
                torsion=hose["GJ_N_m2"],
                bending=hose["EI_N_m2"],
                line_mass=hose["mass_per_length_kg_per_m"],
                loss_factor=hose["loss_factor"],
                torsion_radius=float(np.sqrt(hose["torsion_radius_squared_m2"])),
            ),
        )
        for name, hose in zip(HOSE_NAMES, read_data(COMPRESSOR_DATA)["hoses"], strict=True)
    )


def true_hoses(case: HoseCase, generator: np.random.Generator) -> tuple[Hose, ...]:
    """Return the hoses that a plan asks for; what is not as drawn is uniform."""
    if case is HoseCase.DRAWN:
        return drawn_hoses()
    scattered = tuple(_scattered(hose, generator) for hose in drawn_hoses())
    if case is HoseCase.SCATTERED:
        return scattered
    return tuple(_displaced(hose, generator) for hose in scattered)


def _scattered(hose: Hose, generator: np.random.Generator) -> Hose:
    """Draw stiffness, mass and loss of a hose."""
    names = ("tension", "torsion", "bending", "line_mass", "loss_factor")
    factors = dict(zip(names, generator.uniform(*SCATTER, len(names)), strict=True))
    numbers = {name: factor * getattr(hose.beam, name) for name, factor in factors.items()}
    return replace(hose, beam=replace(hose.beam, **numbers))


def _displaced(hose: Hose, generator: np.random.Generator) -> Hose:
    """Draw port, direction and length of a hose."""
    drawn = generator.uniform(-1, 1, 7)
    direction = hose.direction + LEAN * drawn[3:6]
    return replace(
        hose,
        position=hose.position + PORT_OFFSET * drawn[:3],
        direction=direction / np.linalg.norm(direction),
        beam=replace(hose.beam, length=hose.beam.length * (1 + LENGTH_SPREAD * float(drawn[6]))),
    )


@dataclass(frozen=True)
class Softening:
    """How a mount softens: ``1 + β (1/(1 + s/s_c) − 1/(1 + s_h/s_c))`` over its amplitude s.

    - `share`: β, from rest to large amplitudes [1].
    - `scale`: s_c [m].
    - `reference`: s_h, at which the factor is 1: the amplitude of a usual hit [m].
    """

    share: float
    scale: float
    reference: float

    def factor(self, amplitude: RealArray) -> RealArray:
        """Return the factor on the dynamic stiffness at each amplitude [m]."""
        at_reference = 1 / (1 + self.reference / self.scale)
        return np.asarray(1 + self.share * (1 / (1 + amplitude / self.scale) - at_reference))


@dataclass(frozen=True)
class Receiver:
    """What carries each mount along each of its axes: one mode and a residual compliance.

    Frequency [Hz], modal mass [kg] and loss factor [1] of the mode; stiffness of all that lies
    above [N/m], and its loss factor [1].
    """

    frequency: float
    mass: float
    loss: float
    residual: float
    residual_loss: float

    def receptance(self, frequency: RealArray) -> ComplexArray:
        """Return displacement per force, shape (f,) [m/N]."""
        squared = (2 * np.pi * np.asarray(frequency)) ** 2
        natural = (2 * np.pi * self.frequency) ** 2 * (1 + 1j * self.loss)
        return np.asarray(
            1 / (self.residual * (1 + 1j * self.residual_loss))
            + 1 / (self.mass * (natural - squared))
        )


@dataclass(frozen=True)
class Joint:
    """What joins the two parts of a body that is not rigid, the second of which lies at x > 0.

    Both parts have a share of the mass matrix M of the whole, and the joint is
    ``(2π f)² μ (1 − μ) M (1 + jη)``: together they weigh M, and all six relative modes of the free
    body lie at f [Hz].
    """

    frequency: float
    share: float = 0.5
    loss: float = 0.02


@dataclass(frozen=True, eq=False)
class Compressor:
    """A compressor on its mounts, as it truly is; the virtual point is the origin.

    - `mass` [kg].
    - `centre` (3,): centre of gravity [m].
    - `inertia` (3, 3): inertia about the centre of gravity [kg m²].
    - `positions`, `rotations` (n_mount, 3): places of the mounts [m], and their rotations about the
      fixed axes x, then y, then z [rad]; local x is axial.
    - `stiffness` (n_mount, 3): static stiffness, axial and two radial [N/m].
    - `gain` (6,): real limit, slope, offset, imaginary limit, slope, offset of the dynamic gain.
    - `softening`: softening with the amplitude.
    - `receiver`: receiver under each mount; None for rigid ground.
    - `joint`: joint of two parts; None for a rigid body.
    - `hoses`: hoses whose other ends are held; a body with hoses is rigid.
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

    @property
    def mass_matrix(self) -> RealArray:
        """Mass matrix at the virtual point, shape (6, 6) [kg, kg m, kg m²]."""
        return mass_matrix(self.mass, self.inertia, self.centre)

    @property
    def static_stiffness(self) -> RealArray:
        """Stiffness at the virtual point on rigid ground, shape (6, 6) [N/m, N/rad, N m/rad]."""
        orientations = rotation_matrix(self.rotations)
        return np.asarray(
            mount_stiffness_matrix(self.positions, self.stiffness, orientations), dtype=float
        )

    def gain_at(self, frequency: RealArray) -> ComplexArray:
        """Return dynamic over static stiffness, ``v∞ − 1/(m f + w₀)`` in both parts, (f,) [1]."""
        limits, slopes, offsets = self.gain.reshape(2, 3).T
        parts = limits - 1 / (np.multiply.outer(frequency, slopes) + offsets)
        return np.asarray(parts @ [1, 1j])

    def mount_stiffness(
        self, frequency: RealArray, factors: RealArray | None = None
    ) -> ComplexArray:
        """Return the stiffness of the mounts with their receiver at the virtual point, (f, 6, 6).

        Factors of softening are (n_mount,) or (f, n_mount), by default 1 [N/m, N/rad, N m/rad].
        """
        factors = np.ones(len(self.positions)) if factors is None else factors
        local = self.gain_at(frequency)[:, None, None] * (factors[..., None] * self.stiffness)
        if self.receiver is not None:
            # mount and receiver carry one force: their compliances add
            local = local / (1 + local * self.receiver.receptance(frequency)[:, None, None])
        orientations = rotation_matrix(self.rotations)
        return np.asarray(mount_stiffness_matrix(self.positions, local, orientations))

    def dynamic_stiffness(
        self, frequency: RealArray, factors: RealArray | None = None
    ) -> ComplexArray:
        """Return force per displacement of the body, or of both of its parts, with its hoses.

        Shape (f, 6, 6), or (f, 12, 12) for a body of two parts, of which the mounts hold the first
        [N/m, N/rad, N m/rad].
        """
        whole, mounts = self.mass_matrix, self.mount_stiffness(frequency, factors)
        support = mounts + held_stiffness(self.hoses, frequency)
        squared = ((2 * np.pi * np.asarray(frequency)) ** 2)[:, None, None]
        if self.joint is None:
            return np.asarray(support - squared * whole)
        share = self.joint.share
        complex_square = (2 * np.pi * self.joint.frequency) ** 2 * (1 + 1j * self.joint.loss)
        joined = complex_square * share * (1 - share) * whole
        both = np.empty((len(squared), 12, 12), dtype=complex)
        both[:, :6, :6] = support + joined - squared * (1 - share) * whole
        both[:, 6:, 6:] = joined - squared * share * whole
        both[:, :6, 6:] = both[:, 6:, :6] = -joined
        return both

    def inertance(self, frequency: RealArray, factors: RealArray | None = None) -> ComplexArray:
        """Return acceleration per force, shaped as `dynamic_stiffness` [1/kg, …]; 0 at 0 Hz."""
        squared = ((2 * np.pi * np.asarray(frequency)) ** 2)[:, None, None]
        return np.asarray(-squared * np.linalg.inv(self.dynamic_stiffness(frequency, factors)))

    def on_parts(self, rows: RealArray, positions: RealArray) -> RealArray:
        """Put rows (n, 6) of a rigid body on the part of the body where each point (n, 3) lies.

        Rows of a body of two parts are (n, 12).
        """
        if self.joint is None:
            return rows
        second = (positions[:, :1] > 0).astype(float)
        return np.hstack([(1 - second) * rows, second * rows])

    @property
    def mount_rows(self) -> RealArray:
        """Motion of the body → motion of the mounts, three rows each, along fixed axes."""
        rows = forward_matrices(self.positions)
        return rows if self.joint is None else np.hstack([rows, np.zeros_like(rows)])


def true_compressor(plan: CompressorPlan, generator: np.random.Generator) -> Compressor:
    """Return the compressor that a plan asks for.

    A random case is uniform around table 10, its gain around the true values; then the hoses are
    drawn.
    """
    data = read_data(COMPRESSOR_DATA)
    case = _table_11(data) if plan.case is CompressorCase.TABLE11 else _random(data, generator)
    stiffness = case["stiffness"]
    if plan.identical_mounts:
        axial, radial = stiffness[:, 0].mean(), stiffness[:, 1:].mean()
        case["stiffness"] = np.tile([axial, radial, radial], (len(stiffness), 1))
    if plan.free:
        case["stiffness"] = 1e-4 * case["stiffness"]
    states = data["operation"]
    return Compressor(
        **case,
        softening=Softening(**states["amplitude_law"]) if plan.softening else None,
        receiver=Receiver(**states["flexible_receiver"]) if plan.flexible_receiver else None,
        joint=Joint(plan.flexible_body) if plan.flexible_body else None,
        hoses=true_hoses(plan.hoses, generator) if plan.hoses else (),
    )


def inertia_tensor(elements: RealArray) -> RealArray:
    """Return the tensor of xx, yy, zz, xy, xz, yz, products with their sign, shape (3, 3)."""
    xx, yy, zz, xy, xz, yz = elements
    return np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])


def _table_11(data: dict[str, Any]) -> dict[str, Any]:
    """Return the true compressor of the thesis."""
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
    """Draw a compressor around the drawing."""
    start, spread = data["start_table10"], data["random_case_spread"]

    def around(value: object, width: float, relative: bool = False) -> RealArray:
        middle = np.array(value, dtype=float)
        deviation = width * generator.uniform(-1, 1, middle.shape)
        return np.asarray(middle * (1 + deviation) if relative else middle + deviation)

    elements = np.array(start["inertia_kg_m2_xx_yy_zz_xy_xz_yz"])
    stiffness = start["mount_static_stiffness_N_per_m_axial_radial1_radial2"]
    mass = float(around(start["mass_kg"], spread["mass_kg"]))
    centre = around(np.zeros(3), spread["centre_of_gravity_m"])
    moments = around(elements[:3], spread["inertia_relative"], relative=True)
    products = around(elements[3:], spread["inertia_products_kg_m2"])
    return {
        "mass": mass,
        "centre": centre,
        "inertia": inertia_tensor(np.concatenate([moments, products])),
        "positions": around(start["mount_position_m"], spread["position_m"]),
        "rotations": np.deg2rad(around(start["mount_rotation_deg"], spread["rotation_deg"])),
        "stiffness": around(stiffness, spread["stiffness_relative"], relative=True),
        "gain": around(_gain(data["truth"]), spread["gain_relative"], relative=True),
    }


def _gain(truth: dict[str, Any]) -> RealArray:
    """Return the six numbers of the dynamic gain."""
    return np.array([*truth["gain_real_vinf_m_w0"], *truth["gain_imag_vinf_m_w0"]])
