"""One vehicle on different days: what temperature, doors and seals do to its body."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from deboom.bench.body import Body
from deboom.bench.fleet_prior import modified_body
from deboom.bench.parameters import read_data


@dataclass(frozen=True)
class StateSpread:
    """Standard deviations of a body from state to state.

    Judgement, such that natural frequencies spread by 0.1 % and the lowest, which is all trunk
    floor, by 0.5 %; a thirtieth of what the vehicles of the fleet spread in their panels.

    Parameters
    ----------
    panel_mass, panel_stiffness : float
        Of each panel, of what the fleet's own spread counts in [1].
    path_shape_log, damping_log : float
        Logarithm of the local shape at each path, and of each damping ratio [1].
    """

    panel_mass: float = 0.003
    panel_stiffness: float = 0.006
    path_shape_log: float = 0.01
    damping_log: float = 0.03


NO_STATE_SPREAD = StateSpread(0.0, 0.0, 0.0, 0.0)


def in_state(body: Body, spread: StateSpread, generator: np.random.Generator) -> Body:
    """Return a body as it is on another day.

    Parameters
    ----------
    body : Body
        As it is on average.
    spread : StateSpread
        How much the days differ.
    generator : Generator
        Draws the day.
    """
    prior = read_data("body_prior.json")
    mass = np.array(prior["panel_mass_kg"])
    stiffness = mass * (2 * np.pi * prior["panel_frequency_Hz"]) ** 2
    n_mode, n_path = body.shapes_at_paths.shape
    return modified_body(
        body,
        panel_mass=mass * generator.normal(0, spread.panel_mass, mass.size),
        panel_stiffness=stiffness * generator.normal(0, spread.panel_stiffness, mass.size),
        path_factor=np.exp(generator.normal(0, spread.path_shape_log, n_path)),
        damping_factor=np.exp(generator.normal(0, spread.damping_log, n_mode)),
    )
