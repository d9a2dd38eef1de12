"""Booming model: SPLV of a design with all draws of its scatter, in every vehicle.

One evaluation is one design: all draws x vehicles x lines, with the motion prescribed, coupled (a
6x6 complex solution per line) or amplitude-dependent (a fixed point of such solutions per line;
stiffnesses soften by about a tenth per doubled amplitude). The loop is plain numpy draw by draw;
with amplitudes it takes six sweeps from rest. All rivals use one thread and the same random data.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
import pandas as pd
from scipy.spatial.transform import Rotation
from threadpoolctl import threadpool_limits

from deboom.arrays import ComplexArray, RealArray
from deboom.physics.rigid_body import forward_matrices, mass_matrix
from deboom.vehicles.amplitude_motion import AmplitudeMotion
from deboom.vehicles.booming_model import Motion
from deboom.vehicles.coupled_motion import Body, CoupledMotion, FlexibleMotion
from deboom.vehicles.fleet import PathContributions
from deboom.vehicles.kernels import level_sum
from interleaved import quiet_seconds

LOOP = "loop over draws"
NUMPY, NUMBA = "model, numpy", "model, numba"
BESIDE = "model, numba, without"
SWEEPS = 6
LARGEST = 2.0
"""Amplitude up to which the drawn stiffnesses soften [mm]."""

Case = PathContributions | CoupledMotion
Sums = Callable[[RealArray], RealArray]


@dataclass(frozen=True)
class Shape:
    """How much is one evaluation, and how many designs a call of the model gets."""

    title: str
    n_draws: int
    n_vehicles: int
    n_lines: int
    n_mounts: int
    n_wheel_ends: int
    n_designs: int

    @property
    def n_variables(self) -> int:
        """Stiffness factors, three per mount."""
        return 3 * (self.n_mounts + (self.n_wheel_ends > 0))


SHAPES = (
    Shape("100 draws x 5 vehicles x 321 lines, 4 powertrain mounts", 100, 5, 321, 4, 0, 16),
    Shape("128 draws x 5 vehicles x 161 lines, as shipped", 128, 5, 161, 3, 2, 1),
)


def prescribed_problem(shape: Shape, seed: int = 1) -> PathContributions:
    """Draw random contributions of about 1 mPa; two axes of wheel ends transmit nothing."""
    rng = np.random.default_rng(seed)
    size = (shape.n_vehicles, shape.n_lines, shape.n_variables)
    values = 1e-3 * (rng.normal(size=size) + 1j * rng.normal(size=size))
    values[:, :, 3 * shape.n_mounts + 1 :] = 0.0
    lines = np.linspace(20.0, 60.0, shape.n_lines)
    names = _names(shape)
    return PathContributions(f"drawn {seed}", lines, values, *names)


def coupled_problem(shape: Shape, seed: int = 1) -> CoupledMotion:
    """Draw a plausible powertrain: 200 kg, rigid-body modes of 8 to 35 Hz, losses of 10 to 20 %."""
    rng = np.random.default_rng(seed)
    lines = np.linspace(20.0, 60.0, shape.n_lines)
    place = (lines - 20.0) / 40.0
    corner = np.array([[0.05, 0.43, 0.2], [-0.03, -0.45, 0.19], [0.2, -0.06, -0.27]])
    extra = rng.uniform(-0.4, 0.4, (max(shape.n_mounts - 3, 0), 3))
    positions = np.vstack([corner, extra])[: shape.n_mounts]
    n = 3 * shape.n_mounts

    def stiffness(count: int) -> ComplexArray:
        real = rng.uniform(1e5, 6e5, count) * (1 + np.outer(place, rng.uniform(0.05, 0.25, count)))
        return np.asarray(real * (1 + 1j * rng.uniform(0.10, 0.20, count)))

    def smooth(*size: int) -> ComplexArray:
        ripples = np.cos(np.pi * np.outer(place, np.arange(8)))
        parts = rng.normal(size=(8, *size)) + 1j * rng.normal(size=(8, *size))
        return np.tensordot(ripples, parts, axes=1)

    inertia = [[11.0, -0.06, -0.26], [-0.06, 6.8, 0.53], [-0.26, 0.53, 9.6]]
    powertrain = Body(
        load=np.array([30.0, 10.0, 30.0, 20.0, 150.0, 10.0]) * smooth(6),
        mass_matrix=mass_matrix(195.0, inertia),
        forward=forward_matrices(positions),
        stiffness=stiffness(n),
        variables=np.arange(n),
        transfer=1e-3 * np.moveaxis(smooth(shape.n_vehicles, n), 0, 1),
    )
    springs = stiffness(shape.n_wheel_ends)
    loads = 50.0 * smooth(shape.n_wheel_ends)
    to_ear = 1e-3 * np.moveaxis(smooth(shape.n_vehicles, 1), 0, 1)
    wheel_ends = [
        Body(
            mass_matrix=np.full((1, 1), 40.0),
            forward=np.ones((1, 1)),
            stiffness=springs[:, [end]],
            load=loads[:, [end]],
            variables=np.array([n]),
            transfer=to_ear,
        )
        for end in range(shape.n_wheel_ends)
    ]
    names = _names(shape)
    return CoupledMotion(f"drawn {seed}", lines, (powertrain, *wheel_ends), *names)


def amplitude_problem(shape: Shape, seed: int = 1, softening: float = 0.30) -> AmplitudeMotion:
    """Draw a powertrain whose stiffnesses fall by about `softening` in the first millimetre.

    Beyond `LARGEST` they stay. The load is such that one amplitude in twenty is above 1 mm.
    """
    drawn = coupled_problem(shape, seed)
    gain = 1e-3 / np.quantile(drawn.nominal_amplitude, 0.95)
    coupled = replace(drawn, bodies=tuple(replace(b, load=gain * b.load) for b in drawn.bodies))
    amplitude = 1e3 * coupled.nominal_amplitude
    rng = np.random.default_rng(seed)
    slope = softening * rng.uniform(0.7, 1.3, amplitude.shape[1]) * (1 - 0.3j)
    law = np.stack(np.broadcast_arrays(1.0, -slope, 0.4 * slope, -0.05 * slope), axis=-1)
    cubic = law * amplitude[..., np.newaxis] ** np.arange(4)
    cubic /= cubic.sum(axis=-1, keepdims=True)
    cubic[amplitude > LARGEST] = [1.0, 0.0, 0.0, 0.0]
    highest = np.maximum(LARGEST / amplitude, 1.0)
    lowest = np.zeros(amplitude.shape)
    return AmplitudeMotion(**vars(coupled), cubic=cubic, lowest=lowest, highest=highest)


def tilted(case: CoupledMotion, seed: int = 3) -> CoupledMotion:
    """Turn every powertrain mount of a problem by up to 45 degrees about each axis."""
    rng = np.random.default_rng(seed)
    powertrain = case.bodies[0]
    forward = powertrain.forward.reshape(-1, 3, 6)
    angles = rng.uniform(-45.0, 45.0, (len(forward), 3))
    turns = Rotation.from_euler("xyz", angles, degrees=True).as_matrix()
    turned = (turns.swapaxes(1, 2) @ forward).reshape(-1, 6)
    return replace(case, bodies=(replace(powertrain, forward=turned), *case.bodies[1:]))


def tilted_problem(shape: Shape) -> CoupledMotion:
    """Draw the powertrain of `coupled_problem` on tilted mounts."""
    return tilted(coupled_problem(shape))


def flexible_problem(shape: Shape) -> FlexibleMotion:
    """Put the powertrain of `coupled_problem` on bodies of ten modes, another one per vehicle."""
    coupled = coupled_problem(shape)
    rng = np.random.default_rng(4)
    n_springs, squared = coupled.variables.size, coupled.angular_frequency_squared
    natural = (2 * np.pi * rng.uniform(15.0, 90.0, (shape.n_vehicles, 10))) ** 2 * (1 + 0.06j)
    shapes = 0.04 * rng.normal(size=(shape.n_vehicles, 10, n_springs))
    answer = 1.0 / (natural[:, np.newaxis] - squared[:, np.newaxis])
    receptance = np.einsum("vms,vfm,vmt->vfst", shapes, answer, shapes)
    return FlexibleMotion(**vars(coupled), receptance=receptance)


PROBLEMS: dict[Motion, Callable[[Shape], Case]] = {
    Motion.prescribed: prescribed_problem,
    Motion.coupled: coupled_problem,
    Motion.amplitude: amplitude_problem,
}


OTHER_PROBLEMS: dict[str, Callable[[Shape], Case]] = {
    "coupled motion of tilted mounts": tilted_problem,
    "coupled motion on bodies that give way": flexible_problem,
}
"""Measured beside coupled motion without what the title names."""


def designs(shape: Shape, seed: int = 2) -> RealArray:
    """Draw designs within 20 % and their scatter of 5 %, shape (n_designs n_draws, n_variable)."""
    rng = np.random.default_rng(seed)
    nominal = rng.uniform(0.8, 1.2, (shape.n_designs, 1, shape.n_variables))
    scatter = 1 + 0.05 * rng.normal(size=(shape.n_draws, shape.n_variables))
    return np.asarray((nominal * scatter).reshape(-1, shape.n_variables))


def loop(case: Case, rows: RealArray) -> RealArray:
    """Return the sums of levels draw by draw, as one would write it first."""
    if isinstance(case, CoupledMotion) and not isinstance(case, AmplitudeMotion):
        return np.concatenate([at_once(case, row[np.newaxis]) for row in rows])
    if isinstance(case, PathContributions):
        sums = np.empty((len(rows), len(case.values)))
        for d, row in enumerate(rows):
            for v, values in enumerate(case.values):
                sums[d, v] = np.sum(10 * np.log10(np.abs(values @ row) ** 2))
        return sums
    powertrain, *wheel_ends = case.bodies
    n_body, forward = powertrain.variables.size, powertrain.forward
    squared = case.angular_frequency_squared[:, np.newaxis]
    inertia = squared[..., np.newaxis] * powertrain.mass_matrix
    end_inertia = squared * np.array([end.mass_matrix[0, 0] for end in wheel_ends])
    end_load = np.hstack([np.empty((len(squared), 0)), *(end.load for end in wheel_ends)])
    nominal, transfer, c = case.stiffness, case.transfer, case.cubic
    levels = []
    for row in rows:
        factors = row[case.variables]
        ratio = np.zeros(case.lowest.shape)
        for _ in range(SWEEPS):
            t = np.minimum(ratio, case.highest)
            relative = c[..., 0] + t * (c[..., 1] + t * (c[..., 2] + t * c[..., 3]))
            springs = factors * nominal * relative
            body = springs[:, :n_body, np.newaxis] * forward
            matrix = forward.T @ body - inertia
            moved = np.linalg.solve(matrix, powertrain.load[..., np.newaxis])[..., 0]
            ends = end_load / (springs[:, n_body:] - end_inertia)
            displacement = np.hstack([moved @ forward.T, ends])
            ratio = np.abs(displacement) / case.amplitude
        pressure = np.einsum("vfi,fi->vf", transfer, springs * displacement)
        levels.append((20 * np.log10(np.abs(pressure))).sum(axis=-1))
    return np.array(levels)


def at_once(case: CoupledMotion, rows: RealArray) -> RealArray:
    """Return the sums of levels by one batched solution of all draws."""
    return np.asarray((20 * np.log10(np.abs(case.pressure(rows)))).sum(axis=-1))


def exact(case: Case, rows: RealArray) -> RealArray:
    """Return the sums of levels as exactly as double precision allows."""
    if isinstance(case, AmplitudeMotion):
        return level_sum(replace(case, tolerance=1e-12), compiled=False)(rows)
    return loop(case, rows)


def measure(
    motion: Motion, shape: Shape, seconds: float, problem: Callable[[Shape], Case] | None = None
) -> pd.DataFrame:
    """Time all rivals side by side; one row each."""
    case = (problem or PROBLEMS[motion])(shape)
    rows = designs(shape)
    one = rows[: shape.n_draws]
    plain, compiled = (level_sum(case, compiled=compiled) for compiled in (False, True))
    few = one[: {Motion.prescribed: 25, Motion.coupled: 3, Motion.amplitude: 2}[motion]]
    rivals: dict[str, tuple[Sums, RealArray]] = {LOOP: (lambda x: loop(case, x), few)}
    rivals |= {NUMPY: (plain, one), NUMBA: (compiled, rows)}
    if problem is not None:
        rivals |= {BESIDE: (level_sum(PROBLEMS[motion](shape), compiled=True), rows)}

    def bind(sums: Sums, x: RealArray) -> Callable[[], object]:
        return lambda: sums(x)

    # glibc keeps what was freed from now on; without this, large temporaries cost the rivals fresh
    # pages in every call, and einsum up to three times as much
    np.ones(30 * 2**20 // 8)
    with threadpool_limits(1, user_api="blas"):
        calls = {name: bind(*rival) for name, rival in rivals.items()}
        quiet = quiet_seconds(calls, seconds, calls=2 if motion is Motion.amplitude else 4)
        truth = exact(case, one)
        same = [name for name in rivals if name != BESIDE]
        errors = {name: np.abs(rivals[name][0](one) - truth).max() for name in same}
    each = pd.Series({name: quiet[name] * len(one) / len(x) for name, (_, x) in rivals.items()})
    return pd.DataFrame(
        {
            "one evaluation [µs]": 1e6 * each,
            "x loop": each[LOOP] / each,
            "largest error of the sum [dB]": pd.Series(errors),
        }
    )


def report() -> str:
    """Measure every motion and shape and return the tables as text."""
    tables = []
    for motion in Motion:
        for shape in SHAPES:
            table = measure(motion, shape, seconds=8.0)
            formats = ("{:.0f}".format, "{:.1f}".format, "{:.0e}".format)
            text = table.to_string(formatters=dict(zip(table.columns, formats, strict=True)))
            tables.append(f"{motion.value} motion, {shape.title}\n{text}")
    for title, problem in OTHER_PROBLEMS.items():
        for shape in SHAPES:
            table = measure(Motion.coupled, shape, seconds=8.0, problem=problem)
            text = table.to_string(formatters=dict(zip(table.columns, formats, strict=True)))
            tables.append(f"{title}, {shape.title}\n{text}")
    return "\n\n".join(tables)


def _names(shape: Shape) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Return the names of the vehicles and of the variables."""
    vehicles = tuple(f"vehicle {v}" for v in range(shape.n_vehicles))
    return vehicles, tuple(f"m{k // 3} {'xyz'[k % 3]}" for k in range(shape.n_variables))
