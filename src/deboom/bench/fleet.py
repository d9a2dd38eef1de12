"""Trimmed bodies in modal form: the frozen fleet, its prior, and one vehicle on different days.

Vehicles differ by the mass and stiffness of their panels, by damping and by the local shape at the
mounts. No noise transfer function is edited.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from deboom.arrays import ComplexArray, RealArray
from deboom.bench.powertrain import read_data

FROZEN_SEED = 1

LOWEST_FREQUENCY = 8.0
"""A mode stays above this frequency [Hz], whatever stiffness a panel loses."""

LOWEST_DAMPING = 0.01


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


def receptance(body: Body, frequency: RealArray) -> ComplexArray:
    """Find the displacement at the paths per force at the paths, (f, n_path, n_path) [m/N]."""
    shapes = body.shapes_at_paths
    modal = (shapes.T * body.modal_receptance(frequency)[:, None, :]) @ shapes
    return np.asarray(modal + np.diag(1 / body.local_stiffness))


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


def load_fleet(seed: int) -> BenchFleet:
    """Return the fleet that belongs to a seed.

    Seed 1 is the frozen fleet of ``data/fleet.json``, one draw of the prior that was chosen by
    rejection sampling because it shows every phenomenon the thesis reports. Every other seed is a
    draw of the prior as it comes.
    """
    data = read_data("fleet.json")
    frozen = {
        name: read_body(modes, modes["mode_shape_at_paths"], modes["local_stiffness_N_per_m"])
        for name, modes in data["vehicles"].items()
    }
    bodies = frozen if seed == FROZEN_SEED else draw_fleet(seed)
    return BenchFleet(tuple(data["paths"]), read_cabin(data), bodies)


def read_cabin(data: Mapping[str, Any]) -> Cabin:
    """Read the air in the cabin of a fleet's frozen data."""
    return Cabin(
        bulk_modulus=data["rho_c2_Pa"],
        volume=data["cabin_volume_m3"],
        panel_areas=np.array(data["panel_net_volume_area_m2"]),
        modes=tuple(
            CavityMode(
                mode["frequency_Hz"],
                mode["damping_ratio"],
                np.array(mode["shape_at_panel"]),
                mode["shape_at_driver_ear"],
            )
            for mode in data["cavity_modes"]
        ),
    )


def read_body(
    modes: Mapping[str, Any], at_paths: npt.ArrayLike, local_stiffness: npt.ArrayLike
) -> Body:
    """Read the modes of one vehicle in a fleet's frozen data, or in its prior."""
    return Body(
        frequencies=np.array(modes["natural_frequency_Hz"]),
        damping_ratios=np.array(modes["damping_ratio"]),
        shapes_at_paths=np.array(at_paths),
        shapes_at_panels=np.array(modes["mode_shape_at_panels"]),
        local_stiffness=np.array(local_stiffness),
    )


def draw_fleet(seed: int) -> dict[str, Body]:
    """Draw a fleet from the prior: vehicle name, such as ``U06-1``, to its body.

    The last vehicle of the first group carries the high-voltage battery.
    """
    prior = read_data("body_prior.json")
    generator = np.random.default_rng(seed)
    base = _draw_base(prior, generator)
    battery = prior["battery"]
    battery_mass = generator.uniform(*battery["mass_range_kg"])
    battery_stiffness = generator.uniform(*battery["stiffness_range_N_per_m"])
    between_vehicles = BodySpread(**prior["vehicle_spread"])
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
    - `path_factor`, `damping_factor` (n_path,): factors on the local shape at the mounts, and on
      the new modes' damping [1].

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
    damping = np.maximum(body.damping_ratios @ share, LOWEST_DAMPING)
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
    nominal = prior["mode_shape_at_paths_scale"] * np.array(prior["mode_shape_at_paths"])
    factor = np.exp(generator.normal(0, spread["path_shape_log"], nominal.shape))
    flipped = generator.random(nominal.shape) < spread["path_sign_flip_probability"]
    fixed = [prior["paths"].index(path) for path in spread["paths_of_fixed_sign"]]
    flipped[:, fixed] = False
    at_panels = np.array(prior["mode_shape_at_panels"])
    panel_factor = np.exp(generator.normal(0, spread["panel_shape_log"], at_panels.shape))
    return Body(
        frequencies=np.array(prior["natural_frequency_Hz"]),
        damping_ratios=np.array(prior["damping_ratio"]),
        shapes_at_paths=np.where(flipped, -1.0, 1.0) * nominal * factor,
        shapes_at_panels=at_panels * panel_factor,
        local_stiffness=np.array(prior["local_stiffness_N_per_m"]),
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
