"""The true hoses of the virtual compressor: straight viscoelastic beams from its ports outwards."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from deboom.arrays import ComplexArray, RealArray
from deboom.bench.compressor_plan import COMPRESSOR_DATA, HoseCase
from deboom.bench.frozen import freeze_arrays
from deboom.bench.parameters import read_data
from deboom.physics.viscoelastic_beam import (
    ViscoelasticBeam,
    beam_congruence,
    beam_stiffness,
    frame_along,
)

NAMES = ("suction hose", "discharge hose")
SCATTER = (0.75, 1.3)
"""Least and largest stiffness, mass and loss of a scattered hose over the drawn ones [1]."""
PORT_OFFSET, LEAN, LENGTH_SPREAD = 4e-3, 0.09, 0.04
"""Half widths of a displaced hose: port per axis [m], direction per axis [1], length [1]."""


@dataclass(frozen=True, eq=False)
class Hose:
    """One hose.

    Parameters
    ----------
    name : str
        Such as ``suction hose``.
    position : array, shape (3,)
        Of the port on the compressor, from the virtual point [m].
    direction : array, shape (3,)
        Unit vector from the port to the body [1].
    beam : ViscoelasticBeam
    """

    name: str
    position: RealArray
    direction: RealArray
    beam: ViscoelasticBeam

    def __post_init__(self) -> None:
        freeze_arrays(self)

    @property
    def end(self) -> RealArray:
        """Place of the end on the body, from the virtual point, shape (3,) [m]."""
        return np.asarray(self.position + self.beam.length * self.direction)

    def stiffness(self, frequency: RealArray) -> ComplexArray:
        """Return loads on the hose per motion of virtual point and body end, in the fixed axes.

        Parameters
        ----------
        frequency : array, shape (f,)
            From 0; there the hose is what it is at a millihertz [Hz].

        Returns
        -------
        array, shape (f, 12, 12)
            Six degrees of freedom of the compressor at the virtual point, six of the body at the
            end of the hose [N/m, N/rad, N m/rad].
        """
        # a spectral element is a quotient of zeros at 0 Hz
        lines = np.maximum(np.asarray(frequency, dtype=float), 1e-3)
        seen = beam_congruence(frame_along(self.direction), self.position)
        return np.asarray(seen.T @ beam_stiffness(self.beam, lines) @ seen)


def held_stiffness(hoses: Sequence[Hose], frequency: RealArray) -> ComplexArray:
    """Return the stiffness at the virtual point of hoses whose other ends are held.

    Parameters
    ----------
    hoses : sequence of Hose
        None is none.
    frequency : array, shape (f,)
        [Hz].

    Returns
    -------
    array, shape (f, 6, 6)
        [N/m, N/rad, N m/rad].
    """
    lines = np.asarray(frequency, dtype=float)
    if not hoses:
        return np.zeros((lines.size, 6, 6), dtype=complex)
    return _held(tuple(hoses), lines.tobytes())


# whoever lets mounts soften asks for the same lines a thousand times
@lru_cache(maxsize=4)
def _held(hoses: tuple[Hose, ...], lines: bytes) -> ComplexArray:
    total = np.sum([hose.stiffness(np.frombuffer(lines))[:, :6, :6] for hose in hoses], axis=0)
    total.setflags(write=False)
    return np.asarray(total)


def end_loads(hoses: Sequence[Hose], frequency: RealArray) -> ComplexArray:
    """Return loads of the hoses on a body that holds them, per motion of the virtual point.

    Parameters
    ----------
    hoses : sequence of Hose
        At least one.
    frequency : array, shape (f,)
        [Hz].

    Returns
    -------
    array, shape (f, 6 n_hose, 6)
        Force and moment on the body at the end of each hose, along the fixed axes [N/m, N/rad,
        N m/rad].
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
        for name, hose in zip(NAMES, read_data(COMPRESSOR_DATA)["hoses"], strict=True)
    )


def true_hoses(case: HoseCase, generator: np.random.Generator) -> tuple[Hose, ...]:
    """Return the hoses that a plan asks for.

    Parameters
    ----------
    case : HoseCase
        As drawn, scattered, or displaced as well.
    generator : Generator
        Draws what is not as drawn, uniform.
    """
    if case is HoseCase.DRAWN:
        return drawn_hoses()
    scattered = tuple(_scattered(hose, generator) for hose in drawn_hoses())
    if case is HoseCase.SCATTERED:
        return scattered
    return tuple(_displaced(hose, generator) for hose in scattered)


def _scattered(hose: Hose, generator: np.random.Generator) -> Hose:
    tension, torsion, bending, line_mass, loss_factor = generator.uniform(*SCATTER, 5)
    beam = hose.beam
    return replace(
        hose,
        beam=replace(
            beam,
            tension=tension * beam.tension,
            torsion=torsion * beam.torsion,
            bending=bending * beam.bending,
            line_mass=line_mass * beam.line_mass,
            loss_factor=loss_factor * beam.loss_factor,
        ),
    )


def _displaced(hose: Hose, generator: np.random.Generator) -> Hose:
    drawn = generator.uniform(-1, 1, 7)
    direction = hose.direction + LEAN * drawn[3:6]
    return replace(
        hose,
        position=hose.position + PORT_OFFSET * drawn[:3],
        direction=direction / np.linalg.norm(direction),
        beam=replace(hose.beam, length=hose.beam.length * (1 + LENGTH_SPREAD * float(drawn[6]))),
    )
