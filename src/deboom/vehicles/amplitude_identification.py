"""Finds how the stiffnesses of a run follow the amplitude: response surfaces at its lines."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from deboom.arrays import ComplexArray, RealArray
from deboom.errors import InputError
from deboom.measurement.load_case import LoadCase
from deboom.mounts.characterised_mount import CharacterisedMount
from deboom.mounts.response_surface import DynamicStiffnessSurface
from deboom.vehicles.amplitude_motion import AmplitudeMotion
from deboom.vehicles.coupled_motion import CoupledMotion
from deboom.vehicles.design_factor import DYNAMIC, DesignFactor
from deboom.vehicles.surface_limits import backed_range

Surfaces = Mapping[str, DynamicStiffnessSurface]
"""By design variable, ``<mount> <axis>``."""


def identified_surfaces(parts: Sequence[CharacterisedMount]) -> dict[str, DynamicStiffnessSurface]:
    """Return the surfaces over wheel torque of the directions that were identified.

    Parameters
    ----------
    parts : sequence of CharacterisedMount
        From the mount library.

    Returns
    -------
    dict of str to DynamicStiffnessSurface
        By ``<mount> <axis>``.

    Raises
    ------
    InputError
        A surface over static force, which a load case does not carry; a mount twice.
    """
    found: dict[str, DynamicStiffnessSurface] = {}
    for part in parts:
        for direction in part.directions:
            if direction.surface is None or not direction.quality.identified:
                continue
            name = f"{part.mount.name} {direction.axis}"
            surface = direction.surface.response_surface()
            if surface.preload_unit != "N m":
                raise InputError(
                    f"{part.identity}, direction {direction.axis}: its surface is over static "
                    "force, which a load case does not carry: characterise it over wheel torque"
                )
            if name in found:
                raise InputError(f"two characterised mounts are {part.mount.name}: keep one")
            found[name] = surface
    return found


def amplitude_motion(
    coupled: CoupledMotion,
    surfaces: Surfaces,
    load_case: LoadCase,
    factor: DesignFactor = DYNAMIC,
    follow: bool = True,
) -> AmplitudeMotion:
    """Let the stiffnesses of one load case follow the amplitude as the surfaces say.

    Parameters
    ----------
    coupled : CoupledMotion
        Identified from the same load case.
    surfaces : mapping of str to DynamicStiffnessSurface
        By design variable, over wheel torque. A direction without one keeps its stiffness.
    load_case : LoadCase
        With its engine torque.
    factor : DesignFactor
        What a stiffness factor means.
    follow : bool
        Whether stiffnesses follow the amplitude; if not, the motion is coupled only.

    Returns
    -------
    AmplitudeMotion

    Raises
    ------
    InputError
        A run without engine torque; a line that lies outside of the region in which a mount was
        measured.

    Notes
    -----
    ``K(a) = K_run S(T, a, f) / S(T, a_run, f)``: the run's own stiffness times the relative change
    that the surface S gives, so the nominal design moves exactly as measured. At fixed wheel torque
    and line the 20 terms of S collapse to a cubic in the amplitude.

    A surface is believed where lines were measured nearby. Of the amplitudes about the run's own
    one, the nearest that are not believed bound the cubic; beyond a bound the stiffness stays, and
    `AmplitudeMotion.held` says where. It never follows the cubic into the void.
    """
    variables = [*coupled.variables, *coupled.own_variables]
    inside = np.isin(load_case.displacement.frequency, coupled.frequency)
    torque = load_case.wheel_torque[inside]
    amplitude = coupled.nominal_amplitude
    cubic = np.zeros((*amplitude.shape, 4), dtype=complex)
    cubic[..., 0] = 1.0
    lowest, highest = np.zeros(amplitude.shape), np.full(amplitude.shape, np.inf)
    for column, name in enumerate(coupled.variable_names[k] for k in variables):
        if follow and name in surfaces:
            own = amplitude[:, column]
            line = (torque, own, coupled.frequency)
            where = f"load case {load_case.name}, {name}"
            cubic[:, column] = _relative_cubic(surfaces[name], *line)
            low, high = backed_range(surfaces[name], *line, "amplitude", where)
            lowest[:, column], highest[:, column] = low / own, high / own
    ratio = factor.ratio(coupled, surfaces, load_case)
    return AmplitudeMotion(coupled, cubic, lowest, highest, ratio)


def _relative_cubic(
    surface: DynamicStiffnessSurface, torque: RealArray, amplitude: RealArray, frequency: RealArray
) -> ComplexArray:
    """Coefficients (f, 4) of the powers of the amplitude over the nominal one."""
    cubic = surface.at_amplitude(torque, frequency)
    low, high = surface.ranges["amplitude"]
    half = (high - low) / 2 if high > low else 0.5
    middle = (low + high) / 2
    # the scaled amplitude is p g + q with the ratio g
    p, q = amplitude / half, -middle / half
    c = cubic.coefficients.T
    powers = np.stack(
        [
            c[0] + q * (c[1] + q * (c[2] + q * c[3])),
            p * (c[1] + q * (2 * c[2] + q * 3 * c[3])),
            p**2 * (c[2] + q * 3 * c[3]),
            p**3 * c[3],
        ],
        axis=1,
    )
    return np.asarray(powers / cubic(amplitude)[:, np.newaxis])
