"""A trimmed body in modal form: from forces at the mounts to pressure in the cabin."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from deboom.arrays import ComplexArray, RealArray
from deboom.bench.frozen import freeze_arrays


@dataclass(frozen=True, eq=False)
class CavityMode:
    """One acoustic mode of a cabin.

    Parameters
    ----------
    frequency, damping_ratio : float
        [Hz], [1].
    panel_shape : array, shape (n_panel,)
        [1].
    ear_shape : float
        At the driver's ear [1].
    """

    frequency: float
    damping_ratio: float
    panel_shape: RealArray
    ear_shape: float

    def __post_init__(self) -> None:
        freeze_arrays(self)


def cavity_pressure(
    bulk_modulus: float,
    volume: float,
    panel_areas: RealArray,
    modes: Sequence[CavityMode],
    frequency: RealArray,
) -> ComplexArray:
    """Return the pressure at the driver's ear per displacement of each panel.

    Parameters
    ----------
    bulk_modulus, volume, panel_areas
        See `Cabin`.
    modes : sequence of CavityMode
        Besides the uniform compression.
    frequency : array, shape (f,)
        [Hz].

    Returns
    -------
    array, shape (f, n_panel)
        [Pa/m].

    Notes
    -----
    Modal sum of a closed cavity with moving walls, mode 0 (Λ = 1) and others (Λ = 1/2)::

        p/u = ρc² A/V [1 - 2 Σ ψ ψ_ear ω²/(ω_c² - ω² + 2jζω_cω)]
    """
    total = np.ones((np.size(frequency), panel_areas.size), dtype=complex)
    for mode in modes:
        ratio = np.asarray(frequency) / mode.frequency
        answer = ratio**2 / (1 - ratio**2 + 2j * mode.damping_ratio * ratio)
        total -= 2 * mode.ear_shape * np.outer(answer, mode.panel_shape)
    return np.asarray(bulk_modulus * panel_areas / volume * total)


@dataclass(frozen=True, eq=False)
class Cabin:
    """The air in the cabin: uniform compression and the first longitudinal mode.

    Parameters
    ----------
    bulk_modulus : float
        Of air, ρc² [Pa].
    volume : float
        [m³].
    panel_areas : array, shape (n_panel,)
        Net area with which a panel changes the volume, inwards positive [m²].
    panel_shape : array, shape (n_panel,)
        First cabin mode at the panels [1].
    ear_shape : float
        First cabin mode at the driver's ear [1].
    frequency, damping_ratio : float
        Of the first cabin mode [Hz], [1].
    """

    bulk_modulus: float
    volume: float
    panel_areas: RealArray
    panel_shape: RealArray
    ear_shape: float
    frequency: float
    damping_ratio: float

    def __post_init__(self) -> None:
        freeze_arrays(self)

    def pressure(self, frequency: RealArray) -> ComplexArray:
        """Return the pressure at the driver's ear per displacement of each panel.

        Parameters
        ----------
        frequency : array, shape (f,)
            [Hz].

        Returns
        -------
        array, shape (f, n_panel)
            [Pa/m].
        """
        first = CavityMode(self.frequency, self.damping_ratio, self.panel_shape, self.ear_shape)
        return cavity_pressure(
            self.bulk_modulus, self.volume, self.panel_areas, (first,), frequency
        )


@dataclass(frozen=True, eq=False)
class Body:
    """Mass-normalised modes of a trimmed body.

    Parameters
    ----------
    frequencies : array, shape (n_mode,)
        Natural frequencies [Hz].
    damping_ratios : array, shape (n_mode,)
        [1].
    shapes_at_paths : array, shape (n_mode, n_path)
        Along the force of each path [kg^-1/2].
    shapes_at_panels : array, shape (n_mode, n_panel)
        Inwards [kg^-1/2].
    local_stiffness : array, shape (n_path,)
        Of the body right at each path [N/m].
    """

    frequencies: RealArray
    damping_ratios: RealArray
    shapes_at_paths: RealArray
    shapes_at_panels: RealArray
    local_stiffness: RealArray

    def __post_init__(self) -> None:
        freeze_arrays(self)

    def modal_receptance(self, frequency: RealArray) -> ComplexArray:
        """Return the modal coordinate per modal force, shape (f, n_mode) [s²]."""
        w = 2 * np.pi * np.asarray(frequency)[:, None]
        wn = 2 * np.pi * self.frequencies
        return np.asarray(1 / (wn**2 - w**2 + 2j * self.damping_ratios * wn * w))


def noise_transfer(body: Body, cabin: Cabin, frequency: RealArray) -> ComplexArray:
    """Find the pressure at the driver's ear per force at each path.

    Parameters
    ----------
    body : Body
        Its structural modes.
    cabin : Cabin
        Its air.
    frequency : array, shape (f,)
        [Hz].

    Returns
    -------
    array, shape (f, n_path)
        [Pa/N].
    """
    per_mode = cabin.pressure(frequency) @ body.shapes_at_panels.T
    return np.asarray((per_mode * body.modal_receptance(frequency)) @ body.shapes_at_paths)


def receptance(body: Body, frequency: RealArray) -> ComplexArray:
    """Find the displacement of the body at the paths per force at the paths.

    Returns
    -------
    array, shape (f, n_path, n_path)
        Modes and local flexibility [m/N].
    """
    modal = np.einsum(
        "nl,fn,nk->flk",
        body.shapes_at_paths,
        body.modal_receptance(frequency),
        body.shapes_at_paths,
    )
    return np.asarray(modal + np.diag(1 / body.local_stiffness))
