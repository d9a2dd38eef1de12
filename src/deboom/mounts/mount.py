"""Mounts: positions, rotations, pieces and transfer axes."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Literal, get_args

import numpy as np
import numpy.typing as npt

from deboom.arrays import AXES, ComplexArray, RealArray, checked
from deboom.errors import InputError
from deboom.measurement.channels import LoadCase, Spectrum
from deboom.physics.dynamic_stiffness import dynamic_stiffness
from deboom.physics.rigid_body import rotation_matrix

Side = Literal["engine", "body"]
"""End of a mount that a bracket holds."""
SIDES: tuple[Side, ...] = get_args(Side)


@checked(frequency="f", stiffness="line 3")
class Bracket:
    """What holds a mount in the car, and gives way in series with its rubber.

    - `side`: end of the mount that it holds.
    - `frequency` (f,): lines of the stiffness; none where it is the same at all lines [Hz].
    - `stiffness` (f, 3) or (1, 3): complex dynamic stiffness of each piece's bracket along the axes
      of the mount [N/m].
    - raises InputError: a stiffness of 0.
    """

    side: Side
    frequency: RealArray
    stiffness: ComplexArray

    def __post_init__(self) -> None:
        if not np.all(self.stiffness):
            raise InputError("a bracket without stiffness holds nothing: state its stiffness")

    def compliance(self, frequency: RealArray) -> ComplexArray:
        """Return the displacement per force along each axis at some lines, (f, 3) [m/N].

        - raises InputError: lines at which the bracket was not measured.
        """
        if not self.frequency.size:
            return np.broadcast_to(1.0 / self.stiffness, (frequency.size, len(AXES)))
        at = np.searchsorted(self.frequency, frequency)
        at = np.minimum(at, self.frequency.size - 1)
        if not np.array_equal(self.frequency[at], frequency):
            raise InputError("a bracket has other lines than the runs: bring both to the same ones")
        return np.asarray(1.0 / self.stiffness[at])


@dataclass(frozen=True)
class RubberInCar:
    """How stiff the rubber of a mount is in the car, over its stiffness in the test.

    - `per_kelvin` (2,): bounds of the change of its logarithm per kelvin [1/K].
    - `warmer` (2,): bounds of the temperature in use over that of the test [K].
    - `on_the_road`: what cars themselves show of it, instead [1].
    - `spread`: standard deviation of the logarithm of that, from car to car; None where nothing was
      seen in a car [1].
    - raises InputError: bounds in the wrong order; a stiffness of 0 or less.
    """

    per_kelvin: tuple[float, float] = (0.0, 0.0)
    warmer: tuple[float, float] = (0.0, 0.0)
    on_the_road: float = 1.0
    spread: float | None = None

    def __post_init__(self) -> None:
        ordered = self.per_kelvin[0] <= self.per_kelvin[1] and self.warmer[0] <= self.warmer[1]
        if not (ordered and 0.0 < self.on_the_road < math.inf and (self.spread or 0.0) >= 0.0):
            raise InputError(
                f"{self}: give bounds from low to high, a stiffness above 0 and its spread"
            )

    @property
    def factor(self) -> float:
        """Stiffness that is expected in the car, over that in the test [1]."""
        return self.on_the_road * self.at(0.5, 0.5)

    def at(self, share_of_coefficient: float, share_of_temperature: float) -> float:
        """Return the stiffness over that in the test, at shares of both bounds' widths [1]."""
        coefficient = float(np.interp(share_of_coefficient, (0.0, 1.0), self.per_kelvin))
        return math.exp(coefficient * np.interp(share_of_temperature, (0.0, 1.0), self.warmer))


@dataclass(frozen=True)
class Mount:
    """One mount of the platform.

    Stiffness, response surfaces, design variables and the supplier's numbers are along the axes of
    the mount itself. Motion, forces, positions, transfer axes and noise transfer functions are in
    vehicle axes. Where a mount stands along the vehicle's axes, both are the same.

    - `name`: name, such as ``TSM``.
    - `description`: description in words, for the report.
    - `pieces`: names of the pieces that share the part number, such as ``("left", "right")``; one
      piece has the name ``""``.
    - `positions`: virtual point of each piece in vehicle axes, from the powertrain's centre of
      gravity [m].
    - `transfer_axes`: vehicle axes whose force reaches the cabin. The other axes stay design
      variables without effect.
    - `body_mass`, optional: mass of the body that each piece carries where that is not the
      powertrain, such as the wheel end on a wishbone mount [kg]; None for a powertrain mount.
    - `body_mass_tolerance`: half width of the body mass [kg].
    - `rotations`: turns of vehicle axes into the axes of each piece, about the fixed axes x, then
      y, then z, ``R = Rz Ry Rx`` as for sensors [rad]; none: all stand along the vehicle's axes.
    - `brackets`: that hold it in the car and were not between the sensors of its test; none: rigid.
    - `description_de`: the same in German, for German sheets; empty: not known.
    - `rubber`, optional: what is stated of its rubber in the car; None: as in the test.
    - raises InputError: unknown axes; a tolerance below 0 or above the body mass; rotations that
      are not one per piece, not finite or beyond a whole turn.
    """

    name: str
    description: str
    pieces: tuple[str, ...]
    positions: tuple[tuple[float, float, float], ...]
    transfer_axes: tuple[str, ...]
    body_mass: float | None = None
    body_mass_tolerance: float = 0.0
    rotations: tuple[tuple[float, float, float], ...] = ()
    brackets: tuple[Bracket, ...] = ()
    rubber: RubberInCar | None = None
    description_de: str = ""

    def __post_init__(self) -> None:
        rotations = tuple(tuple(angles) for angles in self.rotations)
        rotations = rotations or ((0.0, 0.0, 0.0),) * len(self.pieces)
        object.__setattr__(self, "rotations", rotations)
        turns = all(
            len(angles) == len(AXES) and all(abs(angle) <= 2.0 * math.pi for angle in angles)
            for angles in rotations
        )
        if len(rotations) != len(self.pieces) or not turns:
            raise InputError(
                f"mount {self.name}: rotations {rotations} for {len(self.pieces)} piece(s): give "
                "each piece three angles about x, y and z of at most a whole turn, in rad"
            )
        unknown = [axis for axis in self.transfer_axes if axis not in AXES]
        if unknown:
            raise InputError(f"mount {self.name}: unknown axes {unknown}, use {list(AXES)}")
        if not 0.0 <= self.body_mass_tolerance <= (self.body_mass or 0.0):
            raise InputError(
                f"mount {self.name}: a body of {self.body_mass} ± {self.body_mass_tolerance} kg: "
                "give a mass above 0 and a smaller tolerance"
            )

    @property
    def carries_powertrain(self) -> bool:
        """Whether the mount carries the powertrain, not a body of its own."""
        return self.body_mass is None

    @property
    def tilted_pieces(self) -> tuple[int, ...]:
        """Numbers of the pieces that do not stand along the vehicle's axes."""
        return tuple(piece for piece, angles in enumerate(self.rotations) if any(angles))

    def orientation(self, piece: int) -> RealArray:
        """Return the axes of a piece as columns in vehicle axes, shape (3, 3) [1]."""
        return rotation_matrix(self.rotations[piece])

    @property
    def variables(self) -> tuple[str, ...]:
        """Names of the design variables, ``<mount> <axis>`` for all three axes."""
        return tuple(f"{self.name} {axis}" for axis in AXES)

    @property
    def paths(self) -> tuple[str, ...]:
        """Names of the paths into the body, ``<mount> <axis>`` for the transfer axes."""
        return tuple(f"{self.name} {axis}" for axis in self.transfer_axes)

    def channels(self, axis: str) -> tuple[str, ...]:
        """Names of the channels measured along one axis, one per piece."""
        return tuple(" ".join(filter(None, (self.name, piece, axis))) for piece in self.pieces)


def in_mount_axes(mounts: Sequence[Mount], load_case: LoadCase) -> LoadCase:
    """Turn motion and forces of a load case from vehicle axes into the axes of each mount.

    ``s' = Rᵀ s`` and ``f' = Rᵀ f`` at every piece that is tilted; the channels keep their names,
    and ``<mount> x`` is then along the mount's x. Other channels stay, bit for bit.

    - raises InputError: a tilted piece of which not all three axes were measured.
    """
    return _turned(mounts, load_case, back=False)


def in_vehicle_axes(mounts: Sequence[Mount], load_case: LoadCase) -> LoadCase:
    """Turn motion and forces back that `in_mount_axes` turned."""
    return _turned(mounts, load_case, back=True)


def _turned(mounts: Sequence[Mount], load_case: LoadCase, *, back: bool) -> LoadCase:
    tilted = [(mount, piece) for mount in mounts for piece in mount.tilted_pieces]
    if not tilted:
        return load_case

    def turned(spectrum: Spectrum, quantity: str) -> Spectrum:
        values = spectrum.values.copy()
        for mount, piece in tilted:
            names = [mount.channels(axis)[piece] for axis in AXES]
            missing = [name for name in names if name not in spectrum.channels]
            if len(missing) == len(AXES):
                continue
            if missing:
                raise InputError(
                    f"load case {load_case.name}: no {quantity} of {missing}: mount {mount.name} "
                    "is tilted, so that what it does along its axes needs all three vehicle axes; "
                    "measure them, or state rotations of 0"
                )
            columns = [spectrum.channels.index(name) for name in names]
            turn = mount.orientation(piece)
            values[:, columns] = values[:, columns] @ (turn.T if back else turn)
        return replace(spectrum, values=values)

    return replace(
        load_case,
        displacement=turned(load_case.displacement, "displacement"),
        force=turned(load_case.force, "force"),
    )


LEAST_LOSS_FACTOR = -0.08
"""Below this a mount would drive the powertrain. A direction that hardly moves reads slightly
negative when sensors are half a degree askew: down to -0.06 in 140 drawn platforms [1]."""


JUDGED_COHERENCE = 0.5
"""Least share of a force's energy that goes with its displacement for its sign to be judged [1].
Directions that carry the load reach 0.9; one that hardly moves shows the errors of its sensors."""


LOSS_COHERENCE = 0.8
"""The same for the sign of its loss, which a few degrees of phase turn where a direction shows the
errors of its sensors [1]."""


def _over_all_lines(load_case: LoadCase) -> Iterator[tuple[str, complex, float]]:
    """Each channel with the stiffness that fits all lines best and their coherence.

    ``K = Σ f s* / Σ |s|²`` and ``|Σ f s*|² / (Σ |s|² Σ |f|²)``: no single line counts.
    """
    for name, force, displacement in zip(
        load_case.force.channels,
        load_case.force.values.T,
        load_case.displacement.values.T,
        strict=True,
    ):
        cross = complex(np.vdot(displacement, force))
        energy = float(np.vdot(displacement, displacement).real)
        of_force = float(np.vdot(force, force).real)
        coherence = abs(cross) ** 2 / (energy * of_force) if of_force > 0 else 0.0
        yield name, cross / energy, coherence


def not_identified(load_case: LoadCase) -> tuple[str, ...]:
    """Name the channels whose displacement hardly explains their force, see `in_mount_axes`.

    Such a direction hardly moves: what its sensors show is mostly the mount's other axes. Its
    measured force counts as it is, its stiffness is not known.
    """
    return tuple(name for name, _, share in _over_all_lines(load_case) if share < JUDGED_COHERENCE)


def refuse_active_mounts(load_case: LoadCase) -> None:
    """Refuse a run in which a mount has a negative stiffness or a negative loss.

    The run's motion and forces are along the axes of the mounts, see `in_mount_axes`.

    Real mounts only store and lose energy. A negative stiffness means force and displacement of
    opposite signs; a negative loss means conjugated spectra (factor e^{-jωt}) or a phase error.
    Directions that are `not_identified` have no sign to judge.

    - raises InputError: names load case, channel and what to check.
    """
    for name, stiffness, coherence in _over_all_lines(load_case):
        if coherence < JUDGED_COHERENCE:
            continue
        if not stiffness.real > 0.0:
            raise InputError(
                f"load case {load_case.name}: channel '{name}' has a negative stiffness of "
                f"{stiffness.real * 1e-3:.3g} N/mm over all lines: check the sign of its force and "
                "its displacement"
            )
        loss = stiffness.imag / stiffness.real
        if coherence >= LOSS_COHERENCE and loss < LEAST_LOSS_FACTOR:
            raise InputError(
                f"load case {load_case.name}: channel '{name}' has a negative loss factor of "
                f"{loss:.3g} over all lines: check its phase, and that the spectra have the factor "
                "e^(+jωt)"
            )


def mean_operating_stiffness(
    mount: Mount, load_case: LoadCase, band: tuple[float, float]
) -> npt.NDArray[np.float64]:
    """Return the mean magnitude of a mount's dynamic stiffness along its own axes over a run.

    One number to read beside a stiffness factor; over a full-load run the stiffness itself grows
    with the preload. Pieces are averaged (thesis, eq. 30: K = f / s at the virtual point).

    - `mount`: mount of the run, whose motion and forces are in vehicle axes.
    - `band` (float, float): first and last frequency, both included [Hz].
    - returns (3,): ``mean |f / s|`` for x, y, z [N/m]; nan for an axis without channels.
    - raises InputError: a band without lines.
    """
    load_case = in_mount_axes([mount], load_case)
    frequency = load_case.displacement.frequency
    lines = (frequency >= band[0]) & (frequency <= band[1])
    if not lines.any():
        raise InputError(
            f"load case {load_case.name}: no line between {band[0]:g} and {band[1]:g} Hz; "
            f"the run covers {frequency[0]:g} to {frequency[-1]:g} Hz"
        )
    stiffness = np.full(len(AXES), np.nan)
    for place, axis in enumerate(AXES):
        names = mount.channels(axis)
        if not set(names) <= set(load_case.force.channels):
            continue
        force = load_case.force.select(names).values[lines]
        displacement = load_case.displacement.select(names).values[lines]
        stiffness[place] = np.mean(np.abs(dynamic_stiffness(force, displacement)))
    return stiffness


def bracket_softness(
    mount: Mount, load_case: LoadCase, band: tuple[float, float]
) -> npt.NDArray[np.float64]:
    """Return the mean stiffness of a mount over a run, over that of its brackets in series.

    - `mount`, `load_case`, `band`, errors: as of `mean_operating_stiffness`.
    - returns (3,): for x, y, z [1]; 0 without a bracket, nan for an axis without channels.
    """
    frequency = load_case.displacement.frequency
    lines = frequency[(frequency >= band[0]) & (frequency <= band[1])]
    gives = sum((bracket.compliance(lines) for bracket in mount.brackets), np.zeros((1, 3)))
    softness = mean_operating_stiffness(mount, load_case, band) * np.abs(gives).mean(axis=0)
    return np.asarray(softness)
