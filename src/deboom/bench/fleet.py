"""Trimmed bodies in modal form: the frozen fleet, its prior, and how bodies answer at their mounts.

Vehicles differ by the mass and stiffness of their panels, by damping and by the local shape at the
mounts. No noise transfer function is edited. The frozen truth of a body holds its shapes along the
forces of the paths alone; a measurement around a mount also feels how the body turns there, and the
sides of the wishbone differ. Both are a fixed linear map of the frozen shapes, drawn once for the
platform. The interfaces are the virtual points in the order of `deboom.bench.layout.points`.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cache
from typing import Any

import numpy as np
import numpy.typing as npt

from deboom.arrays import AXES, ComplexArray, RealArray
from deboom.bench.powertrain import SIDES, read_data
from deboom.errors import InputError

FROZEN_SEED = 1

LOWEST_FREQUENCY = 8.0
"""A mode stays above this frequency [Hz], whatever stiffness a panel loses."""


@dataclass(frozen=True, eq=False)
class CavityMode:
    """One mode of a cabin: frequency [Hz], damping ratio and shapes at panels and ear [1]."""

    frequency: float
    damping_ratio: float
    panel_shape: RealArray
    ear_shape: float


@dataclass(frozen=True, eq=False)
class Cabin:
    """The air in a cabin: uniform compression and some modes.

    - `bulk_modulus`: bulk modulus of air, ρc² [Pa].
    - `volume` [m³].
    - `panel_areas` (n_panel,): net area with which a panel changes the volume, inwards positive
      [m²].
    - `modes`: modes besides the uniform compression.
    """

    bulk_modulus: float
    volume: float
    panel_areas: RealArray
    modes: tuple[CavityMode, ...]

    def pressure(self, frequency: RealArray) -> ComplexArray:
        """Return the pressure at the ear per displacement of each panel, (f, n_panel) [Pa/m].

        Modal sum of a closed cavity with moving walls, mode 0 (Λ = 1) and others (Λ = 1/2)::

            p/u = ρc² A/V [1 - 2 Σ ψ ψ_ear ω²/(ω_c² - ω² + 2jζω_cω)]
        """
        total = np.ones((np.size(frequency), self.panel_areas.size), dtype=complex)
        for mode in self.modes:
            ratio = np.asarray(frequency) / mode.frequency
            answer = ratio**2 / (1 - ratio**2 + 2j * mode.damping_ratio * ratio)
            total -= 2 * mode.ear_shape * np.outer(answer, mode.panel_shape)
        return np.asarray(self.bulk_modulus * self.panel_areas / self.volume * total)


@dataclass(frozen=True, eq=False)
class Body:
    """Mass-normalised modes of a trimmed body.

    - `frequencies`, `damping_ratios` (n_mode,): [Hz], [1].
    - `shapes_at_paths` (n_mode, n_path): shapes along the force of each path [kg^-1/2].
    - `shapes_at_panels` (n_mode, n_panel): shapes of the panels, inwards [kg^-1/2].
    - `local_stiffness` (n_path,): stiffness of the body right at each path [N/m].
    """

    frequencies: RealArray
    damping_ratios: RealArray
    shapes_at_paths: RealArray
    shapes_at_panels: RealArray
    local_stiffness: RealArray

    def modal_receptance(self, frequency: RealArray) -> ComplexArray:
        """Return the modal coordinate per modal force, shape (f, n_mode) [s²]."""
        w = 2 * np.pi * np.asarray(frequency)[:, None]
        wn = 2 * np.pi * self.frequencies
        return np.asarray(1 / (wn**2 - w**2 + 2j * self.damping_ratios * wn * w))


def noise_transfer(body: Body, cabin: Cabin, frequency: RealArray) -> ComplexArray:
    """Find the pressure at the driver's ear per force at each path, shape (f, n_path) [Pa/N]."""
    per_mode = cabin.pressure(frequency) @ body.shapes_at_panels.T
    return np.asarray((per_mode * body.modal_receptance(frequency)) @ body.shapes_at_paths)


REAR_EAR = -0.8
"""Shape of the first cabin mode, along the car, at the rear seats over that at the driver [1];
judgement."""

RECEIVER_SEED = 22
"""Draws seats and wheels of a platform, for every fleet: they belong to the truth."""

OWN_MODES = (15.0, 35.0)
"""First mode of a seat on its rails and of a wheel on its column [Hz]."""

OWN_DAMPING = (0.05, 0.1)
"""Damping ratio of these [1]; judgement."""

OWN_SPREAD = 0.03
"""Standard deviation of the logarithm of their frequency between cars; judgement."""

FOOT = 0.005
"""How far the foot of a seat or a wheel moves for what a panel moves, standard deviation [1];
judgement, such that a seat vibrates by some 0.001 m/s², and by 0.1 where it booms."""


def receiver_transfer(
    body: Body, cabin: Cabin, frequency: RealArray, generator: np.random.Generator
) -> dict[str, ComplexArray]:
    """Find what is heard and felt at other places than the driver's ear, per force at each path.

    - `generator`: of what one car has for itself.
    - returns by `RECEIVERS` (f, n_path): pressure at the rear ear [Pa/N], acceleration of seat rail
      and wheel [(m/s²)/N].
    """
    (mode,) = cabin.modes
    rear = replace(cabin, modes=(replace(mode, ear_shape=REAR_EAR * mode.ear_shape),))
    heard = {RECEIVERS[0]: noise_transfer(body, rear, frequency)}
    of_platform = np.random.default_rng(RECEIVER_SEED)
    for name in RECEIVERS[1:]:
        share = of_platform.normal(0, FOOT, body.shapes_at_panels.shape[1])
        own, damping = of_platform.uniform(*OWN_MODES), of_platform.uniform(*OWN_DAMPING)
        ratio = frequency / (own * np.exp(generator.normal(0, OWN_SPREAD)))
        follows = (1 + 2j * damping * ratio) / (1 - ratio**2 + 2j * damping * ratio)
        foot = body.modal_receptance(frequency) * (body.shapes_at_panels @ share)
        accelerance = -((2 * np.pi * frequency) ** 2) * follows
        heard[name] = accelerance[:, np.newaxis] * (foot @ body.shapes_at_paths)
    return heard


RECEIVERS = ("rear ear", "seat rail z", "wheel y")
"""Receivers beside the driver's ear."""


def receptance(body: Body, frequency: RealArray) -> ComplexArray:
    """Find the displacement at the paths per force at the paths, (f, n_path, n_path) [m/N]."""
    shapes = body.shapes_at_paths
    modal = (shapes.T * body.modal_receptance(frequency)[:, None, :]) @ shapes
    return np.asarray(modal + np.diag(1 / body.local_stiffness))


def path_receptance(body: Body, frequency: RealArray, *, per_piece: bool = False) -> ComplexArray:
    """Find the displacement at the paths per force at the paths, (f, n_path, n_path) [m/N].

    With `per_piece` each side of the wishbone is a path, else both move in phase as `receptance`.
    """
    if not per_piece:
        return receptance(body, frequency)
    at = interface_shapes(body)
    n_mount = at.shape[1] - len(SIDES)
    shapes = np.hstack([at[:, :n_mount, :3].reshape(len(at), -1), at[:, n_mount:, 0]])
    local = local_flexibility(body)
    flexibility = np.concatenate([local[:n_mount].ravel(), local[n_mount:, 0]])
    modal = (shapes.T * body.modal_receptance(frequency)[:, None, :]) @ shapes
    return np.asarray(modal + np.diag(flexibility))


@dataclass(frozen=True, eq=False)
class BenchFleet:
    """Bodies of one platform, by names such as ``U06-1``, and the air that all of them enclose.

    Paths are the forces into the body, such as ``TSM x``; ``Du x`` stands for both sides in phase.
    """

    paths: tuple[str, ...]
    cabin: Cabin
    bodies: Mapping[str, Body]


@dataclass(frozen=True)
class BodySpread:
    """Standard deviations of a body: from day to day, or between nominally identical vehicles.

    The defaults are those of one vehicle on different days: what temperature, doors and seals do.
    Judgement, such that natural frequencies spread by 0.1 % and the lowest, which is all trunk
    floor, by 0.5 %; a thirtieth of what the vehicles of the fleet spread in their panels.

    - `panel_mass`, `panel_stiffness`: share of each panel's mass and stiffness [1].
    - `path_shape_log`, `damping_log`: logarithm of the local shape at each path, and of each
      damping ratio [1].
    - `scatter`: factor on all of them [1].
    """

    panel_mass: float = 0.003
    panel_stiffness: float = 0.006
    path_shape_log: float = 0.01
    damping_log: float = 0.03
    scatter: float = 1.0


NO_SPREAD = BodySpread(0.0, 0.0, 0.0, 0.0)


LITERATURE_SCATTER = 2.0
"""Factor on the prior's spread between cars of one drawing with which levels at the ear differ by
10 to 15 dB, as those of the thesis (section 2.4.3, figure 10)."""


def load_fleet(seed: int, body_scatter: float = 1.0) -> BenchFleet:
    """Return the fleet that belongs to a seed.

    Seed 1 is the frozen fleet of ``data/fleet.json``, one draw of the prior that was chosen by
    rejection sampling because it shows every phenomenon the thesis reports. Every other seed is a
    draw of the prior as it comes.

    - `body_scatter`: factor on what cars of one drawing differ by [1]; noise transfer functions
      of four or five alike cars span 6 dB in the median with 1 and 11 dB with
      `LITERATURE_SCATTER`.
    - raises InputError: a factor that is negative or not finite; another one than 1 for the frozen
      fleet.
    """
    if not 0 <= body_scatter < np.inf:
        raise InputError(f"a body scatter of {body_scatter:g}: give a factor from 0, such as 2")
    if seed == FROZEN_SEED and body_scatter != 1:
        raise InputError(
            f"a body scatter of {body_scatter:g} with seed {FROZEN_SEED}, whose fleet is frozen: "
            "take a seed from 2"
        )
    data = read_data("fleet.json")
    frozen = {
        name: Body(**{key: np.array(values) for key, values in modes.items()})
        for name, modes in data["vehicles"].items()
    }
    bodies = frozen if seed == FROZEN_SEED else draw_fleet(seed, body_scatter)
    return BenchFleet(tuple(data["paths"]), read_cabin(data), bodies)


def read_cabin(data: Mapping[str, Any]) -> Cabin:
    """Read the air in the cabin of a fleet's frozen data."""
    modes = (mode | {"panel_shape": np.array(mode["panel_shape"])} for mode in data["modes"])
    areas = np.array(data["panel_areas"])
    return Cabin(data["bulk_modulus"], data["volume"], areas, tuple(CavityMode(**m) for m in modes))


def draw_fleet(seed: int, body_scatter: float = 1.0) -> dict[str, Body]:
    """Draw a fleet from the prior: vehicle name, such as ``U06-1``, to its body.

    The last vehicle of the first group carries the high-voltage battery. `body_scatter` is that of
    `load_fleet`.
    """
    prior = read_data("body_prior.json")
    generator = np.random.default_rng(seed)
    base = _draw_base(prior, generator)
    battery = prior["battery"]
    battery_mass = generator.uniform(*battery["mass_range_kg"])
    battery_stiffness = generator.uniform(*battery["stiffness_range_N_per_m"])
    between_vehicles = BodySpread(**prior["vehicle_spread"])
    between_vehicles = replace(between_vehicles, scatter=body_scatter * between_vehicles.scatter)
    fleet: dict[str, Body] = {}
    for group in prior["groups"]:
        body = base
        if group in prior["variants"]:
            body = _variant(base, prior["variants"][group], generator)
        for number in range(1, prior["vehicles_per_group"] + 1):
            fleet[f"{group}-{number}"] = scattered_body(body, between_vehicles, generator)
    fleet[battery["vehicle"]] = modified_body(
        fleet[battery["vehicle"]],
        panel_mass=battery_mass * np.array(battery["mass_share_at_panels"]),
        panel_stiffness=battery_stiffness * np.array(battery["stiffness_share_at_panels"]),
    )
    return fleet


def scattered_body(body: Body, spread: BodySpread, generator: np.random.Generator) -> Body:
    """Draw a body around another one, with panels, local shapes and damping of its own."""
    prior = read_data("body_prior.json")
    panel_mass = np.array(prior["panel_mass_kg"])
    panel_stiffness = panel_mass * (2 * np.pi * prior["panel_frequency_Hz"]) ** 2
    n_mode, n_path = body.shapes_at_paths.shape

    def drawn(deviation: float, size: int) -> RealArray:
        return np.asarray(spread.scatter * generator.normal(0, deviation, size))

    return modified_body(
        body,
        panel_mass=drawn(spread.panel_mass, panel_mass.size) * panel_mass,
        panel_stiffness=drawn(spread.panel_stiffness, panel_mass.size) * panel_stiffness,
        path_factor=np.exp(drawn(spread.path_shape_log, n_path)),
        damping_factor=np.exp(drawn(spread.damping_log, n_mode)),
    )


def modified_body(
    body: Body,
    panel_mass: RealArray,
    panel_stiffness: RealArray,
    path_factor: npt.ArrayLike = 1.0,
    damping_factor: npt.ArrayLike = 1.0,
) -> Body:
    """Find the modes of a body after changes to its panels.

    - `body`: body before the change.
    - `panel_mass`, `panel_stiffness` (n_panel,): mass and stiffness added to each panel [kg],
      [N/m]; negative values take away.
    - `path_factor` (n_path,), `damping_factor` (n_mode,): factors on the local shape at each path,
      and on the new modes' damping [1].

    Each change is of rank one in modal coordinates, ``ΔM = Δm φφᵀ``, ``ΔK = Δk φφᵀ``, and the
    eigenproblem is solved again. A new mode keeps the sign and the mean damping of the modes it is
    made of. Valid while the first modes span the change.
    """
    shapes = body.shapes_at_panels
    mass = np.eye(shapes.shape[0]) + (shapes * panel_mass) @ shapes.T
    stiffness = np.diag((2 * np.pi * body.frequencies) ** 2) + (shapes * panel_stiffness) @ shapes.T
    scale = np.linalg.inv(np.linalg.cholesky(mass))
    squared, vectors = np.linalg.eigh(scale @ stiffness @ scale.T)
    modes = scale.T @ vectors
    modes = modes * np.where(np.diag(modes) < 0, -1.0, 1.0)
    share = modes**2 / np.sum(modes**2, axis=0)
    damping = body.damping_ratios @ share
    frequencies = np.sqrt(np.maximum(squared, (2 * np.pi * LOWEST_FREQUENCY) ** 2)) / (2 * np.pi)
    return Body(
        frequencies=frequencies,
        damping_ratios=damping * damping_factor,
        shapes_at_paths=modes.T @ body.shapes_at_paths * path_factor,
        shapes_at_panels=modes.T @ shapes,
        local_stiffness=body.local_stiffness,
    )


def _draw_base(prior: dict[str, Any], generator: np.random.Generator) -> Body:
    """Draw the platform's body: the nominal shapes with a log-normal factor and random signs."""
    spread = prior["base_spread"]
    nominal = prior["shapes_at_paths_scale"] * np.array(prior["shapes_at_paths"])
    factor = np.exp(generator.normal(0, spread["path_shape_log"], nominal.shape))
    flipped = generator.random(nominal.shape) < spread["path_sign_flip_probability"]
    fixed = [prior["paths"].index(path) for path in spread["paths_of_fixed_sign"]]
    flipped[:, fixed] = False
    at_panels = np.array(prior["shapes_at_panels"])
    panel_factor = np.exp(generator.normal(0, spread["panel_shape_log"], at_panels.shape))
    return Body(
        frequencies=np.array(prior["frequencies"]),
        damping_ratios=np.array(prior["damping_ratios"]),
        shapes_at_paths=np.where(flipped, -1.0, 1.0) * nominal * factor,
        shapes_at_panels=at_panels * panel_factor,
        local_stiffness=np.array(prior["local_stiffness"]),
    )


def _variant(body: Body, change: dict[str, Any], generator: np.random.Generator) -> Body:
    """Make another body of the platform: other panels and another front end's local shapes."""
    n_path = body.shapes_at_paths.shape[1]
    return modified_body(
        body,
        panel_mass=np.array(change["panel_mass_kg"]),
        panel_stiffness=np.array(change["panel_stiffness_N_per_m"]),
        path_factor=np.exp(generator.normal(0, change["path_shape_log"], n_path)),
    )


INTERFACE_SEED, EAR_SEED = 20, 21
"""Draw the map, and the passenger's seat with the cabin's lateral mode, for every vehicle of every
fleet: they belong to the truth."""

ROTATION_LENGTH = 0.4
"""A mode that moves the interfaces by 1 turns them by 1 over this length [m]; judgement, between
the span of the front carrier and that of a long member."""

SIDE_SPREAD = 0.3
"""Part in which the sides of the wishbone differ, against their common shape [1]; judgement."""

N_MOTION = 6

EARS = ("driver ear", "passenger ear")

SEAT_SPREAD = 0.05
"""How far the seats differ along the first cabin mode, standard deviation [1]; judgement."""

LATERAL_FREQUENCY, LATERAL_DAMPING, LATERAL_AT_EAR = 122.0, 0.06, 0.6
"""First lateral mode of a cabin 1.4 m wide [Hz], [1], and its shape at an ear [1]."""

LATERAL_AT_PANELS = 0.3
"""What a panel, left and right together, shows of the lateral mode: spread [1]; judgement."""


@cache
def _map(n_mount: int) -> RealArray:
    """Draw the map from shapes along the paths to interfaces, shape (6 n_interface, n_path)."""
    n_path = len(AXES) * n_mount + 1
    generator = np.random.default_rng(INTERFACE_SEED)
    n_interface = n_mount + len(SIDES)
    turning = generator.normal(0, 1 / ROTATION_LENGTH, (n_interface, len(AXES), n_path))
    apart = generator.normal(0, SIDE_SPREAD, n_path)
    to_motion = np.zeros((n_interface, N_MOTION, n_path))
    to_motion[:, len(AXES) :] = turning / np.sqrt(n_path)
    for mount in range(n_mount):
        for axis in range(len(AXES)):
            to_motion[mount, axis, len(AXES) * mount + axis] = 1.0
    for side, sign in enumerate((1.0, -1.0), n_mount):
        to_motion[side, 0] = sign * apart / np.sqrt(n_path)
        to_motion[side, 0, -1] += 1.0
    flat = to_motion.reshape(-1, n_path)
    flat.setflags(write=False)
    return flat


def interface_shapes(body: Body) -> RealArray:
    """Return the modes of a body at its interfaces.

    - returns (n_mode, n_interface, 6): translations along x, y, z [kg^-1/2] and rotations about
      them [kg^-1/2/m], at the virtual points. Translations along the paths are the body's own; the
      mean of the wishbone's sides is its ``Du x``, and along y and z nothing reaches the body
      there.
    """
    n_mount = (body.shapes_at_paths.shape[1] - 1) // len(AXES)
    flat = body.shapes_at_paths @ _map(n_mount).T
    return np.asarray(flat.reshape(len(flat), -1, N_MOTION))


def local_flexibility(body: Body) -> RealArray:
    """Return displacement per force right at each interface besides the modes, (n, 3) [m/N].

    Two sides that carry half of a force each give way half as much as one: each side of the
    wishbone has half the stiffness that stands for both.
    """
    stiffness = body.local_stiffness
    sides = np.full((len(SIDES), len(AXES)), stiffness[-1] / len(SIDES))
    return np.asarray(1 / np.vstack([stiffness[:-1].reshape(-1, len(AXES)), sides]))


def point_shapes(body: Body, rows: tuple[RealArray, ...]) -> RealArray:
    """Return what channels around the interfaces see of the modes, shape (n_mode, n_channel).

    Rows are, per interface, motion at the virtual point → channels, shape (n_channel, 6).
    """
    shapes = interface_shapes(body)
    return np.hstack([shapes[:, k] @ forward.T for k, forward in enumerate(rows)])


def point_receptance(
    body: Body,
    frequency: RealArray,
    responses: tuple[RealArray, ...],
    forces: tuple[RealArray, ...],
) -> ComplexArray:
    """Find the displacement at channels around the interfaces per force at others.

    Channels are as in `point_shapes`; the result is (f, n_response, n_force) [m/N].
    """
    modal = body.modal_receptance(frequency)
    seen, pushed = point_shapes(body, responses), point_shapes(body, forces)
    values = np.asarray((seen.T * modal[:, None, :]) @ pushed)
    row = column = 0
    for flexibility, rows, columns in zip(local_flexibility(body), responses, forces, strict=True):
        patch = (rows[:, : len(AXES)] * flexibility) @ columns[:, : len(AXES)].T
        values[:, row : row + len(rows), column : column + len(columns)] += patch
        row, column = row + len(rows), column + len(columns)
    return values


def panel_pressure(cabin: Cabin, frequency: RealArray) -> ComplexArray:
    """Return the pressure at the ears per displacement of each panel, (f, n_ear, n_panel) [Pa/m].

    The driver's pressure is the frozen truth. The difference between two ears at one height is that
    of their seats and of the lateral mode. The frozen truth has nothing of that mode, so the
    passenger carries the whole of it here. The passenger is the same one in every vehicle.
    """
    generator = np.random.default_rng(EAR_SEED)
    (mode,) = cabin.modes
    seat = replace(mode, ear_shape=mode.ear_shape + SEAT_SPREAD * float(generator.normal()))
    at_panels = generator.normal(0, LATERAL_AT_PANELS, cabin.panel_areas.size)
    ratio = frequency / LATERAL_FREQUENCY
    answer = ratio**2 / (1 - ratio**2 + 2j * LATERAL_DAMPING * ratio)
    spring = cabin.bulk_modulus * cabin.panel_areas / cabin.volume
    lateral = -2 * LATERAL_AT_EAR * np.outer(answer, at_panels) * spring
    passenger = replace(cabin, modes=(seat,)).pressure(frequency) + lateral
    return np.stack([cabin.pressure(frequency), passenger], axis=1)


def ear_transfer(body: Body, cabin: Cabin, frequency: RealArray) -> ComplexArray:
    """Find pressure at ears per interface load, (f, n_ear, n_interface, 6) [Pa/N, Pa/(N m)]."""
    per_mode = panel_pressure(cabin, frequency) @ body.shapes_at_panels.T
    modal = per_mode * body.modal_receptance(frequency)[:, None, :]
    return np.asarray(np.einsum("fen,nia->feia", modal, interface_shapes(body)))


def source_motion(body: Body, cabin: Cabin, frequency: RealArray) -> ComplexArray:
    """Find the motion of the interfaces when a loudspeaker breathes at an ear.

    Displacement [1/m²] and rotation [1/m³] per volume displacement, shape (f, n_interface, 6,
    n_ear).

    From the source outwards, with nothing of `ear_transfer` turned round: the volume q raises the
    pressure at every panel; the pressure pushes the panel out of the cabin, against its inward
    shape; the modes answer, and the interfaces move. A cabin answers alike with source and receiver
    exchanged, ``p_panel/q = (p_ear/u_panel)/A``.
    """
    at_panel = panel_pressure(cabin, frequency) / cabin.panel_areas
    outward_force = at_panel * cabin.panel_areas
    modal_force = -outward_force @ body.shapes_at_panels.T
    modal = modal_force * body.modal_receptance(frequency)[:, None, :]
    return np.asarray(np.einsum("fen,nia->fiae", modal, interface_shapes(body)))
