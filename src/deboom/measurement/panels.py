"""Which panel of the cabin brings a mode to the ear."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from deboom.arrays import ComplexArray, RealArray
from deboom.errors import InputError
from deboom.measurement.channels import Frf
from deboom.measurement.modal_analysis import ModalModel
from deboom.physics.frf import FrfForm

PRESSURE_PER_VOLUME_ACCELERATION = "Pa/(m^3/s^2)"


@dataclass(frozen=True, eq=False)
class PanelMeasurement:
    """Panels of the trimmed body, with the loudspeaker at each ear in turn.

    Parameters
    ----------
    names : tuple of str
        Such as ``trunk floor``.
    positions : array, shape (n_panel, 3)
        Of the accelerometers [m].
    normals : array, shape (n_panel, 3)
        Unit vectors into the cabin [1].
    areas : array, shape (n_panel,)
        With which the motion of each accelerometer changes the volume of the cabin [m²].
    motion : Frf
        Outputs are the panels, inputs the ears: acceleration inwards [(m/s²)/(m³/s²)].
    pressure : Frf
        Outputs are the panels, inputs the ears [Pa/(m³/s²)].
    """

    names: tuple[str, ...]
    positions: RealArray
    normals: RealArray
    areas: RealArray
    motion: Frf
    pressure: Frf

    def __post_init__(self) -> None:
        for name in ("positions", "normals", "areas"):
            array = np.array(getattr(self, name), dtype=float)
            array.setflags(write=False)
            object.__setattr__(self, name, array)


@dataclass(frozen=True, eq=False)
class PanelContributions:
    """Pressure at one ear from each panel, mode by mode.

    Parameters
    ----------
    ear : str
    panels : tuple of str
    frequency : array, shape (n_mode,)
        Natural frequencies [Hz].
    values : array, shape (n_mode, n_panel)
        Complex pressure at the ear, with the modes moving as the loudspeaker at this ear moves
        them: modal constants [Pa/(m³/s²) · 1/s].
    """

    ear: str
    panels: tuple[str, ...]
    frequency: RealArray
    values: ComplexArray

    @property
    def pressure(self) -> ComplexArray:
        """What all panels of a mode bring to the ear, shape (n_mode,)."""
        return np.asarray(self.values.sum(axis=1))

    @property
    def shares(self) -> RealArray:
        """Part of each panel in phase with the sum, shape (n_mode, n_panel); a row adds up to 1.

        Negative for a panel that works against the others.
        """
        return np.asarray((self.values / self.pressure[:, np.newaxis]).real)


def panel_contributions(
    model: ModalModel, panels: PanelMeasurement, ear: str
) -> PanelContributions:
    """Multiply the modes at the panels by what each panel transfers to the ear.

    Parameters
    ----------
    model : ModalModel
        Outputs hold the panels, inputs the ear; of accelerations per volume acceleration.
    panels : PanelMeasurement
    ear : str

    Returns
    -------
    PanelContributions

    Raises
    ------
    InputError
        A panel or ear without modal constants, a mode outside the lines of the panels' pressure, a
        model that is not receptance-like.

    Notes
    -----
    A still panel that a loudspeaker at the ear meets with ``p_k/Q̇`` raises, when it moves inwards
    with ``a_k``, at the ear ``p = (p_k/Q̇) A_k a_k`` by reciprocity. Of mode n that is
    ``c_nk = (jω_n)² (p_k/Q̇)(ω_n) A_k R_nk``, with the residue ``R_nk`` of the displacement-like
    ``a_k/Q̇``. Valid for light damping, where ``p_k/Q̇`` changes little over a resonance, and for
    panels that radiate into a cabin of long waves.
    """
    if model.form is not FrfForm.RECEPTANCE:
        raise InputError(
            "panel contributions need a modal model of accelerations per volume acceleration, "
            "which are receptance-like"
        )
    missing = [name for name in (*panels.names, ear) if name not in (*model.outputs, *model.inputs)]
    if missing:
        raise InputError(f"the modal model knows nothing of {missing}: measure them with the rest")
    transfer = panels.pressure.select(inputs=(ear,)).values[:, :, 0]
    lines, at = panels.pressure.frequency, model.frequency
    if at.min() < lines[0] or at.max() > lines[-1]:
        raise InputError(
            f"modes from {at.min():.2f} to {at.max():.2f} Hz, but pressure at the panels from "
            f"{lines[0]:g} to {lines[-1]:g} Hz only"
        )
    at_modes = np.stack([np.interp(at, lines, column) for column in transfer.T], axis=1)
    rows = [model.outputs.index(name) for name in panels.names]
    constants = model.residues[:, rows, model.inputs.index(ear)]
    squared = -((2 * np.pi * at) ** 2)[:, np.newaxis]
    return PanelContributions(ear, panels.names, at, squared * at_modes * panels.areas * constants)


def pressure_of_modes(
    reciprocal: ModalModel, direct: ModalModel, accelerance: ModalModel, ear: str
) -> ComplexArray:
    """Find what the modes bring to the ear without asking any panel.

    Compared with `PanelContributions.pressure` it tells whether a panel has been forgotten.

    Parameters
    ----------
    reciprocal : ModalModel
        Inputs hold the ear: accelerations on the body per volume acceleration.
    direct : ModalModel
        Outputs hold the ear: pressure per force.
    accelerance : ModalModel
        Outputs as in `reciprocal`, inputs as in `direct`: accelerations per force, whatever was
        measured of both.
    ear : str

    Returns
    -------
    array, shape (n_mode,)
        As `PanelContributions.pressure` [Pa/(m³/s²) · 1/s].

    Raises
    ------
    InputError
        Models of different numbers of modes.

    Notes
    -----
    With ``φ`` of the body, the ear's share G in a mode and ``m = 2jω_d``: ``a/Q̇ ∝ −φ_c G/m``,
    ``p/F ∝ G φ_i/m``, ``a/F ∝ φ_c φ_i/m``. The first two over the third, by least squares over all
    channels and forces, are ``−G²/m``, which is what the panels add up to.
    """
    if not len(reciprocal.clusters) == len(direct.clusters) == len(accelerance.clusters):
        raise InputError("the three modal models have different modes: fit them to the same poles")
    channels = [reciprocal.outputs.index(name) for name in accelerance.outputs]
    blows = [direct.inputs.index(name) for name in accelerance.inputs]
    moved = reciprocal.residues[:, channels, reciprocal.inputs.index(ear)]
    heard = direct.residues[:, direct.outputs.index(ear)][:, blows]
    product = moved[:, :, np.newaxis] * heard[:, np.newaxis, :]
    both = accelerance.residues
    return np.asarray(
        np.sum(both.conj() * product, axis=(1, 2)) / np.sum(np.abs(both) ** 2, axis=(1, 2))
    )
