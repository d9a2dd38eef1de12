"""The population that fleets are drawn from: component-level changes of a nominal body.

Vehicles differ by the mass and stiffness of their panels, by damping and by the local shape at the
mounts. No noise transfer function is edited.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from deboom.arrays import RealArray
from deboom.bench.body import Body
from deboom.bench.parameters import read_data

LOWEST_FREQUENCY = 8.0
"""A mode stays above this frequency [Hz], whatever stiffness a panel loses."""

LOWEST_DAMPING = 0.01


def modified_body(
    body: Body,
    panel_mass: RealArray,
    panel_stiffness: RealArray,
    path_factor: npt.ArrayLike = 1.0,
    damping_factor: npt.ArrayLike = 1.0,
) -> Body:
    """Find the modes of a body after changes to its panels.

    Parameters
    ----------
    body : Body
        Before the change.
    panel_mass, panel_stiffness : array, shape (n_panel,)
        Added to each panel [kg], [N/m]; negative values take away.
    path_factor : array_like, shape (n_path,)
        Factor on the local shape at the mounts [1].
    damping_factor : array_like, shape (n_mode,)
        Factor on the new modes' damping [1].

    Returns
    -------
    Body
        New mass-normalised modes.

    Notes
    -----
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


def draw_fleet(seed: int) -> dict[str, Body]:
    """Draw a fleet from the prior.

    Parameters
    ----------
    seed : int
        Of the draw.

    Returns
    -------
    dict of str to Body
        Vehicle name, such as ``U06-1``, to its body; the last vehicle of the first group carries
        the high-voltage battery.
    """
    prior = read_data("body_prior.json")
    generator = np.random.default_rng(seed)
    base = _draw_base(prior, generator)
    battery = prior["battery"]
    battery_mass = generator.uniform(*battery["mass_range_kg"])
    battery_stiffness = generator.uniform(*battery["stiffness_range_N_per_m"])
    fleet: dict[str, Body] = {}
    for group in prior["groups"]:
        body = base
        if group in prior["variants"]:
            body = _variant(base, prior["variants"][group], generator)
        for number in range(1, prior["vehicles_per_group"] + 1):
            fleet[f"{group}-{number}"] = _draw_vehicle(body, prior, generator)
    fleet[battery["vehicle"]] = modified_body(
        fleet[battery["vehicle"]],
        panel_mass=battery_mass * np.array(battery["mass_share_at_panels"]),
        panel_stiffness=battery_stiffness * np.array(battery["stiffness_share_at_panels"]),
    )
    return fleet


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


def _draw_vehicle(body: Body, prior: dict[str, Any], generator: np.random.Generator) -> Body:
    """Draw one of the nominally identical vehicles of a group."""
    spread = prior["vehicle_spread"]
    scatter = spread["scatter"]
    panel_mass = np.array(prior["panel_mass_kg"])
    panel_stiffness = panel_mass * (2 * np.pi * prior["panel_frequency_Hz"]) ** 2
    n_mode, n_path = body.shapes_at_paths.shape
    mass_change = generator.normal(0, spread["panel_mass"], panel_mass.size)
    stiffness_change = generator.normal(0, spread["panel_stiffness"], panel_mass.size)
    return modified_body(
        body,
        panel_mass=scatter * mass_change * panel_mass,
        panel_stiffness=scatter * stiffness_change * panel_stiffness,
        path_factor=np.exp(scatter * generator.normal(0, spread["path_shape_log"], n_path)),
        damping_factor=np.exp(scatter * generator.normal(0, spread["damping_log"], n_mode)),
    )
