"""Cross stiffness: whether a mount's force follows from all three displacements, not its own."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations_with_replacement, permutations, product
from typing import Any

import numpy as np
from scipy.optimize import minimize
from scipy.spatial.transform import Rotation

from deboom.arrays import ComplexArray, RealArray
from deboom.common import AXES
from deboom.measurement.channels import LoadCase
from deboom.measurement.sensors import Tolerances
from deboom.mounts.mount import Mount, in_mount_axes
from deboom.mounts.operating_map import OperatingMap

LINES = 1200
"""Lines that are looked at, at most."""

MISFIT = 0.005
"""Part of a force that its own displacement leaves even along the axes of the mount: the stiffness
is no polynomial [1]."""

CLEAR = 0.55
"""Force that only the other displacements explain, over the most that the stated tolerances let
them explain [1]. Drawn benches with parallel mounts stay below 0.3, because sensors average."""

LARGEST_TOLERATED = 0.3
"""Part of a force that tolerances explain from which an axis says nothing: it hardly moves [1]."""

LARGE = 0.05
"""Part of a force that its own displacement leaves, from which on other axes are looked for [1]."""

LEAST_DROP = 0.3
"""Least part of the unexplained force that all three displacements must explain [1]."""

LARGEST_REST = 0.5
"""Misfit after a turn over that before up to which the turn is named [1]."""

LEAST_ANGLE = np.deg2rad(2.0)
"""Smallest angle that is named [rad]."""

DEGREE = 2
"""Degree of a stiffness over torque, amplitude and frequency in the comparison."""


@dataclass(frozen=True, eq=False)
class CrossStiffness:
    """What the displacements across an axis bring to the force along it.

    - `mount`: ``<mount> [<piece>]``.
    - `alone`, `together` (3,): part of the force along each axis that its own displacement leaves
      unexplained, and all three together [1].
    - `tolerated` (3,): part that the stated tolerances of sensors and cells let other axes explain,
      one standard deviation [1].
    - `angles` (3,): turn from the axes in which force and displacement are given after which each
      axis is best explained by its own displacement, about x, then y, then z; zeros where there is
      no alarm [rad].
    - `turned`: part of the misfit that is left after that turn, over that before [1].
    """

    mount: str
    alone: RealArray
    together: RealArray
    tolerated: RealArray
    angles: RealArray
    turned: float = 1.0

    @property
    def excess(self) -> RealArray:
        """Force that other displacements explain over what tolerances allow, shape (3,) [1]."""
        gain = np.sqrt(np.maximum(self.alone**2 - self.together**2, 0.0))
        drop = self.together < (1.0 - LEAST_DROP) * self.alone
        judged = drop & (self.tolerated < LARGEST_TOLERATED) & (self.alone > LARGE)
        return np.asarray(np.where(judged, gain / self.tolerated, 0.0))

    @property
    def clear(self) -> bool:
        """Whether an axis is clearly better explained by all three displacements."""
        return bool(self.excess.max() > CLEAR)

    @property
    def sentence(self) -> str:
        """Alarm in a sentence."""
        axis = int(np.argmax(self.excess))
        turn = float(np.linalg.norm(Rotation.from_euler("xyz", self.angles).as_rotvec()))
        evidence = (
            f"mount {self.mount}: the displacement along {AXES[axis]} leaves "
            f"{100 * self.alone[axis]:.2g} % of the force along it unexplained, all three together "
            f"{100 * self.together[axis]:.2g} %"
        )
        if turn > LEAST_ANGLE and self.turned < LARGEST_REST:
            angles = ", ".join(f"{np.rad2deg(angle):.0f}" for angle in self.angles)
            return (
                f"{evidence}: it stands at an angle that is not stated; {np.rad2deg(turn):.0f} deg "
                f"would do (rx, ry, rz = {angles} deg from how it is stated to stand): check it, "
                "and state the angles in the mount table"
            )
        return (
            f"{evidence}, and no angle explains it: check its axes and signs, or take it for a "
            "mount with cross stiffness, which factors along axes do not describe"
        )


def cross_stiffness(
    mount: str,
    displacement: ComplexArray,
    force: ComplexArray,
    state: RealArray,
    tolerances: Tolerances,
) -> CrossStiffness:
    """Compare explanations of a mount's force: each axis by its own displacement, or by all three.

    - `mount`: ``<mount> [<piece>]``.
    - `displacement`, `force` (n, 3): along the axes that are stated [m], [N].
    - `state` (n, k): what the stiffness may depend on besides its own amplitude, such as wheel
      torque and frequency.
    - `tolerances`: of sensors, cells and shaker.

    Per axis ``f_a = Σ_b K_ab s_b`` by least squares: K_aa is a polynomial of degree `DEGREE` in the
    state and the axis' own amplitude, K_ab a constant. An accelerometer askew by θ shows ``θ s_b``
    along a, and a shaker askew by φ makes ``φ f_b`` of the force: so much is tolerated.
    """
    every = slice(None, None, -(-len(force) // LINES))
    displacement, force, scaled = displacement[every], force[every], _scaled(state[every])
    askew = np.hypot(tolerances.sensor_angle, tolerances.sensor_cross_axis)

    def sizes(moved: ComplexArray, pushed: ComplexArray) -> tuple[RealArray, RealArray]:
        """Return size of the force and what is tolerated of it, both (3,) [N]."""
        s, f = np.linalg.norm(moved, axis=0), np.linalg.norm(pushed, axis=0)
        stiffness = f / np.maximum(s, np.finfo(float).tiny)
        beside = [np.linalg.norm(np.delete(each, a)) for each in (s, f) for a in range(3)]
        motion, load = np.split(np.array(beside), 2)
        tolerated = np.linalg.norm(
            [askew * stiffness * motion, tolerances.shaker_angle * load, MISFIT * f], axis=0
        )
        return f, np.asarray(tolerated)

    def left_alone(moved: ComplexArray, pushed: ComplexArray) -> RealArray:
        return np.array(
            [_left_over(pushed[:, axis], _own(moved[:, axis], scaled)) for axis in range(3)]
        )

    def misfit(angles: RealArray) -> float:
        turn = Rotation.from_euler("xyz", angles).as_matrix()
        moved, pushed = displacement @ turn, force @ turn
        return float(np.linalg.norm(left_alone(moved, pushed) / sizes(moved, pushed)[1]))

    size, tolerated = sizes(displacement, force)
    together = [
        _left_over(
            force[:, axis],
            np.hstack([_own(displacement[:, axis], scaled), np.delete(displacement, axis, axis=1)]),
        )
        for axis in range(3)
    ]
    upright = np.zeros(3)
    parts = left_alone(displacement, force) / size, np.array(together) / size, tolerated / size
    judged = CrossStiffness(mount, *parts, upright)
    if not judged.clear:
        return judged
    turns = np.deg2rad([-30.0, -15.0, 15.0, 30.0])
    starts = [upright, *(angle * unit for unit in np.eye(3) for angle in turns)]
    start = min(starts, key=misfit)
    simplex = np.vstack([start, start + np.deg2rad(8.0) * np.eye(3)])
    options: Any = {
        "xatol": np.deg2rad(0.1),
        "fatol": 1e-3,
        "maxfev": 300,
        "initial_simplex": simplex,
    }
    best = minimize(misfit, start, method="Nelder-Mead", options=options)
    return CrossStiffness(mount, *parts, _least_turn(best.x), float(best.fun) / misfit(upright))


def _least_turn(angles: RealArray) -> RealArray:
    """Return the smallest turn with the same principal axes, in any order and of any sign."""
    axes = Rotation.from_euler("xyz", angles).as_matrix()
    turns = [
        turn
        for order in permutations(range(3))
        for signs in product((-1.0, 1.0), repeat=3)
        if np.linalg.det(turn := axes[:, order] * signs) > 0.0
    ]
    least = max(turns, key=lambda turn: float(np.trace(turn)))
    return np.asarray(Rotation.from_matrix(least).as_euler("xyz"))


def cross_stiffness_of_maps(
    maps: Mapping[str, OperatingMap], tolerances: Tolerances
) -> tuple[CrossStiffness, ...]:
    """Judge the mounts of a campaign of which all three axes were measured.

    - `maps`: operating maps by ``<mount> <axis>``.
    - `tolerances`: of the campaign.
    """
    judged = []
    for mount in dict.fromkeys(measured.mount for measured in maps.values()):
        axes = [maps.get(f"{mount} {axis}") for axis in AXES]
        of_axes = [measured for measured in axes if measured is not None]
        if len(of_axes) < len(AXES):
            continue
        first = of_axes[0]
        moved, pushed = (
            np.stack([getattr(measured, name) for measured in of_axes], axis=1)
            for name in ("displacement", "force")
        )
        state = np.stack([first.wheel_torque, first.frequency], axis=1)
        judged.append(cross_stiffness(mount, moved, pushed, state, tolerances))
    return tuple(judged)


def cross_stiffness_of_runs(
    mounts: Sequence[Mount], load_cases: Sequence[LoadCase]
) -> tuple[CrossStiffness, ...]:
    """Judge the mounts of a platform of which all three axes were measured.

    - `mounts`: mounts as they are stated to stand.
    - `load_cases`: motion and forces in vehicle axes; runs with engine torque, else by frequency.
    """
    runs = [in_mount_axes(mounts, case) for case in load_cases]
    recorded = all(case.engine_torque is not None for case in runs)
    lines = np.concatenate([case.force.frequency for case in runs])
    columns = [lines]
    if recorded:
        columns.append(np.concatenate([case.wheel_torque for case in runs]))
    state = np.stack(columns, axis=1)
    judged = []
    for mount in mounts:
        for piece in range(len(mount.pieces)):
            names = [mount.channels(axis)[piece] for axis in AXES]
            if not all(set(names) <= set(case.force.channels) for case in runs):
                continue
            moved = np.vstack([case.displacement.select(names).values for case in runs])
            pushed = np.vstack([case.force.select(names).values for case in runs])
            title = f"{mount.name} {mount.pieces[piece]}".strip()
            judged.append(cross_stiffness(title, moved, pushed, state, Tolerances()))
    return tuple(judged)


def _own(displacement: ComplexArray, scaled: RealArray) -> ComplexArray:
    """Terms of an axis' own stiffness times its displacement."""
    amplitude = _scaled(np.log(np.maximum(np.abs(displacement), 1e-12))[:, np.newaxis])
    terms = _polynomials(np.hstack([scaled, amplitude]), DEGREE)
    return np.asarray(terms * displacement[:, np.newaxis])


def _scaled(values: RealArray) -> RealArray:
    """Scale columns to -1 … 1."""
    low, high = values.min(axis=0), values.max(axis=0)
    return np.asarray((2.0 * values - low - high) / np.where(high > low, high - low, 1.0))


def _polynomials(values: RealArray, degree: int) -> RealArray:
    """All products of up to `degree` columns, the constant first."""
    columns = [np.ones(len(values))]
    for power in range(1, degree + 1):
        for which in combinations_with_replacement(range(values.shape[1]), power):
            columns.append(np.prod(values[:, which], axis=1))
    return np.stack(columns, axis=1)


def _left_over(force: ComplexArray, terms: ComplexArray) -> float:
    """Return the norm of what terms leave of a force by least squares [N]."""
    size = np.maximum(np.linalg.norm(terms, axis=0), np.finfo(float).tiny)
    orthonormal = np.linalg.qr(terms / size)[0]
    return float(np.linalg.norm(force - orthonormal @ (orthonormal.conj().T @ force)))
