"""A source bolted to a car body, both of beams: the truth behind a test of component TPA.

Source and receiver are frames of beams with lumped masses; the assembly is solved as a whole, by
its mass and stiffness matrices, so that nothing here uses what an identification uses: neither
receptances that are coupled nor a matrix that is inverted for forces. Blocked forces are the
reactions of the source on a receiver at rest.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from deboom.arrays import DOFS, ComplexArray, RealArray, checked
from deboom.bench.fleet import EARS, Cabin, CavityMode
from deboom.bench.signals import complex_normal
from deboom.bench.writing import check_seed
from deboom.errors import InputError

N_MOTION = len(DOFS)
STEEL, ALUMINIUM = (210e9, 7850.0), (70e9, 2700.0)
"""Young's modulus [Pa] and density [kg/m³]."""
POISSON = 0.3
BODY_LOSS, SOURCE_LOSS = 0.05, 0.01
"""Loss factor of a trimmed body with its joints, and of a casting [1]."""
LARGEST_POINTS = 4
"""Places at which the body has a bracket."""
LINE_STEPS = (0.5, 1.0, 2.0, 4.0)
"""Between the lines of functions [Hz]: whole blocks of the recorder."""
MOUNT_LOSS = 0.12
"""Loss factor of the rubber between source and second receiver [1]."""


@dataclass(frozen=True)
class Section:
    """Cross section of a beam: area [m²], second moments [m⁴], torsion constant [m⁴], material."""

    area: float
    bending: float
    torsion: float
    material: tuple[float, float]


LONGITUDINAL = Section(7.0e-4, 6.0e-7, 8.0e-7, STEEL)
CROSS_MEMBER = Section(5.0e-4, 3.0e-7, 4.0e-7, STEEL)
BRACKET = Section(4.0e-4, 1.2e-7, 1.6e-7, STEEL)
HOUSING = Section(1.5e-3, 6.0e-7, 8.0e-7, ALUMINIUM)
STRAY_BRACKET = Section(3.0e-4, 6.0e-8, 6.0e-8, ALUMINIUM)


def beam_matrices(
    first: npt.ArrayLike, second: npt.ArrayLike, section: Section
) -> tuple[RealArray, RealArray]:
    """Return mass and stiffness of a straight beam in space, (12, 12) each, at both of its ends.

    Euler-Bernoulli bending with cubic shapes, consistent mass (Przemieniecki, Theory of Matrix
    Structural Analysis, 1968, ch. 5 and 11). Ends [m]; the section bends alike about both axes.
    """
    along = np.asarray(second, dtype=float) - np.asarray(first, dtype=float)
    length = float(np.linalg.norm(along))
    modulus, density = section.material
    shear = modulus / (2 * (1 + POISSON))
    mass, stiffness = np.zeros((2, 12, 12))
    line, twist = density * section.area * length, 2 * density * section.bending * length
    for place, stretch, inertia in (
        (0, modulus * section.area / length, line),
        (3, shear * section.torsion / length, twist),
    ):
        ends = np.ix_([place, place + 6], [place, place + 6])
        stiffness[ends] = stretch * np.array([[1, -1], [-1, 1]])
        mass[ends] = inertia / 6 * np.array([[2, 1], [1, 2]])
    bend = modulus * section.bending / length**3
    # deflection and slope at both ends; about y the slope is the other way round
    for deflection, slope, sign in ((1, 5, 1.0), (2, 4, -1.0)):
        ends = np.ix_(*[[deflection, slope, deflection + 6, slope + 6]] * 2)
        a, b = 6 * length * sign, length**2
        stiffness[ends] = bend * np.array(
            [[12, a, -12, a], [a, 4 * b, -a, 2 * b], [-12, -a, 12, -a], [a, 2 * b, -a, 4 * b]]
        )
        c, d = 22 * length * sign, 13 * length * sign
        mass[ends] = (line / 420) * np.array(
            [[156, c, 54, -d], [c, 4 * b, d, -3 * b], [54, d, 156, -c], [-d, -3 * b, -c, 4 * b]]
        )
    x = along / length
    y = np.cross(np.eye(3)[int(np.argmin(np.abs(x)))], x)
    y /= np.linalg.norm(y)
    turn = np.kron(np.eye(4), np.array([x, y, np.cross(x, y)]))
    return turn.T @ mass @ turn, turn.T @ stiffness @ turn


@dataclass(frozen=True, eq=False)
class Frame:
    """Beams between nodes of six motions each.

    - `nodes`: names, in the order of the matrices.
    - `positions` (n_node, 3): [m].
    - `mass` (6 n, 6 n): [kg, kg m²]; `stiffness` (6 n, 6 n): complex, with its losses [N/m, N m].
    """

    nodes: tuple[str, ...]
    positions: RealArray
    mass: RealArray
    stiffness: ComplexArray

    def motions(self, nodes: Sequence[str]) -> list[int]:
        """Return the places of the six motions of some nodes."""
        starts = [N_MOTION * self.nodes.index(node) for node in nodes]
        return [start + motion for start in starts for motion in range(N_MOTION)]

    def at(self, node: str) -> RealArray:
        """Return the place of a node, shape (3,) [m]."""
        place: RealArray = self.positions[self.nodes.index(node)]
        return place

    def dynamic_stiffness(self, frequency: RealArray) -> ComplexArray:
        """Return ``K − ω² M``, shape (f, 6 n, 6 n)."""
        squared = (2 * np.pi * np.asarray(frequency)) ** 2
        return np.asarray(self.stiffness - squared[:, None, None] * self.mass)

    def answer(
        self, frequency: RealArray, outputs: Sequence[str], inputs: Sequence[str]
    ) -> ComplexArray:
        """Return the motion of some nodes per load at others, (f, 6 n_out, 6 n_in) [m/N, …]."""
        columns = self.motions(inputs)
        load = np.zeros((len(self.mass), len(columns)))
        load[columns, np.arange(len(columns))] = 1.0
        moved = np.linalg.solve(self.dynamic_stiffness(frequency), load[None])
        return np.asarray(moved[:, self.motions(outputs)])


def frame(
    places: Mapping[str, npt.ArrayLike],
    beams: Sequence[tuple[str, str, Section]],
    masses: Mapping[str, tuple[float, float]],
    supports: Mapping[str, float],
    loss: float,
) -> Frame:
    """Build a frame of beams.

    - `places`: name of each node to its place, (3,) [m]; `beams`: nodes of both ends, section.
    - `masses`: node to a lumped mass and its radius of gyration [kg], [m].
    - `supports`: node to the stiffness of a soft spring to the ground, along all axes [N/m].
    - `loss`: loss factor of everything [1].
    """
    nodes = tuple(places)
    size = N_MOTION * len(nodes)
    mass, stiffness = np.zeros((2, size, size))
    positions = np.array([places[node] for node in nodes], float)
    whole = Frame(nodes, positions, mass, stiffness.astype(np.complex128))
    for first, second, section in beams:
        ends = np.ix_(*[whole.motions([first, second])] * 2)
        of_mass, of_stiffness = beam_matrices(whole.at(first), whole.at(second), section)
        mass[ends] += of_mass
        stiffness[ends] += of_stiffness
    for node, (weight, radius) in masses.items():
        here = whole.motions([node])
        mass[here, here] += weight * np.repeat([1.0, radius**2], 3)
    for node, spring in supports.items():
        here = whole.motions([node])[:3]
        stiffness[here, here] += spring
    return replace(whole, stiffness=np.asarray(stiffness * (1 + 1j * loss), np.complex128))


def bolted(source: Frame, receiver: Frame, joints: Sequence[str]) -> Frame:
    """Return source and receiver as one frame, whose nodes of the same name are one."""
    nodes = (*source.nodes, *(node for node in receiver.nodes if node not in joints))
    size = N_MOTION * len(nodes)
    positions = [source.at(n) if n in source.nodes else receiver.at(n) for n in nodes]
    empty = np.zeros((size, size))
    whole = Frame(nodes, np.array(positions), empty, empty.astype(np.complex128))
    for part in (source, receiver):
        here = np.ix_(*[whole.motions(part.nodes)] * 2)
        whole.mass[here] += part.mass
        whole.stiffness[here] += part.stiffness
    return whole


def mounted(
    source: Frame, receiver: Frame, joints: Sequence[str], stiffness: ComplexArray
) -> tuple[Frame, dict[str, str]]:
    """Return source and receiver with mounts between nodes of the same name, as one frame.

    - `stiffness` (n_joint, 3): complex stiffness of each mount along x, y and z [N/m].
    - returns: the frame, and the name of each node of the receiver in it.
    """
    names = {node: f"body {node}" if node in joints else node for node in receiver.nodes}
    whole = bolted(source, replace(receiver, nodes=tuple(names.values())), ())
    for joint, springs in zip(joints, stiffness, strict=True):
        above, below = whole.motions([joint])[:3], whole.motions([names[joint]])[:3]
        for top, bottom, spring in zip(above, below, springs, strict=True):
            ends = np.ix_([top, bottom], [top, bottom])
            whole.stiffness[ends] += spring * np.array([[1, -1], [-1, 1]])
    return whole, names


POINT_PLACES = ((0.55, -0.34, -0.02), (0.60, 0.33, 0.03), (0.98, 0.04, -0.08), (0.78, 0.20, 0.16))
"""Where the source is bolted to the body, the last one by a bracket that nobody measured [m]."""
STRAY = "stray bracket"
BEARINGS, HOUSINGS = ("bearing 1", "bearing 2"), ("housing 1", "housing 2")
"""Where the source is shaken from inside, and where a hammer reaches its housing."""
PANELS = ("L2", "L4", "R2", "R4", "C1", "C3")
"""Nodes of the body that carry a panel of the cabin."""
INDICATORS = ("L1", "R1", "C0")
"""Nodes of the body with a sensor beside those at the points."""
ON_BOARD = ("L2", "R2")
"""Nodes whose sensors take no part in an inversion."""
N_SECTION = 6
"""Nodes of each longitudinal."""


@checked(points=">=1", unmeasured_point=">=0 <inf", airborne=">=0 <inf")
class ComponentPlan:
    """What is tested, and what the test leaves out.

    - `points`: places at which the source is bolted, 1 to 3.
    - `unmeasured_rotations`: state and report translations alone, though moments act as well.
    - `unmeasured_point`: section of a bracket that joins source and body besides, which nobody
      measured, over `STRAY_BRACKET`; 0: there is none [1].
    - `airborne`: energy of the sound that reaches the ears through the air, over that through the
      structure [1].
    - `line_step`: between the lines of functions and spectra [Hz].
    - raises InputError: no point, or more than the body has brackets; another step of the lines
      than one of `LINE_STEPS`.
    """

    points: int = 3
    unmeasured_rotations: bool = False
    unmeasured_point: float = 0.0
    airborne: float = 0.0
    line_step: float = 2.0

    def __post_init__(self) -> None:
        if self.points >= LARGEST_POINTS:
            raise InputError(
                f"{self.points} points: the body has brackets for 1 to {LARGEST_POINTS - 1}"
            )
        if self.line_step not in LINE_STEPS:
            steps = ", ".join(f"{step:g}" for step in LINE_STEPS)
            raise InputError(f"lines {self.line_step:g} Hz apart: give one of {steps} Hz")

    @property
    def names(self) -> tuple[str, ...]:
        """Points that the test states."""
        return tuple(f"point {number + 1}" for number in range(self.points))

    @property
    def joints(self) -> tuple[str, ...]:
        """Points at which source and body are truly joined."""
        return (*self.names, STRAY) if self.unmeasured_point else self.names


def places_of(plan: ComponentPlan) -> dict[str, RealArray]:
    """Return the place of every joint, shape (3,) [m]."""
    places = dict(zip(plan.names, POINT_PLACES, strict=False))
    if plan.unmeasured_point:
        places[STRAY] = POINT_PLACES[-1]
    return {name: np.array(place) for name, place in places.items()}


def draw_source(plan: ComponentPlan, generator: np.random.Generator) -> Frame:
    """Draw a drive unit of about 60 kg on stiff arms, whose first elastic mode lies near 200 Hz."""
    joints = places_of(plan)
    centre = np.array([0.72, 0.02, 0.10]) + 0.02 * generator.standard_normal(3)
    places = {
        **joints,
        "core": centre,
        "bearing 1": centre + np.array([-0.04, -0.14, 0.02]),
        "bearing 2": centre + np.array([0.03, 0.15, -0.01]),
        "housing 1": centre + np.array([-0.13, -0.05, 0.09]),
        "housing 2": centre + np.array([0.11, 0.09, 0.12]),
    }
    scale = np.exp(0.15 * generator.standard_normal(len(places)))
    size = plan.unmeasured_point
    stray = replace(STRAY_BRACKET, area=size * STRAY_BRACKET.area)
    arms = [
        ("core", node, _scaled(stray, size * factor) if node == STRAY else _scaled(HOUSING, factor))
        for node, factor in zip(places, scale, strict=True)
        if node != "core"
    ]
    weight = 45.0 * float(np.exp(0.1 * generator.standard_normal()))
    masses = {"core": (weight, 0.13), **dict.fromkeys(BEARINGS, (5.0, 0.05))}
    masses |= dict.fromkeys(HOUSINGS, (1.5, 0.05))
    return frame(places, [*arms, (*BEARINGS, HOUSING)], masses, {}, SOURCE_LOSS)


def draw_body(plan: ComponentPlan, generator: np.random.Generator) -> Frame:
    """Draw a body: two longitudinals with cross members and trim, and a bracket per joint.

    First bending and torsion near 20 to 40 Hz, and about twenty modes up to 140 Hz.
    """
    along = np.linspace(0.0, 3.2, N_SECTION)
    places: dict[str, RealArray] = {}
    for k, x in enumerate(along):
        places |= {f"L{k}": np.array([x, -0.55, 0.0]), f"R{k}": np.array([x, 0.55, 0.0])}
    for k in range(N_SECTION - 2):
        # a member leans forward and rearward in turns, so that nothing is symmetric
        lean = 0.5 * along[1] * (k % 2)
        places[f"C{k}"] = np.array([along[k] + lean, 0.05 * (-1) ** k, 0.08])
    beams = []
    for k in range(N_SECTION - 1):
        beams += [(f"{side}{k}", f"{side}{k + 1}", LONGITUDINAL) for side in "LR"]
    for k in range(N_SECTION - 2):
        beams += [(f"L{k}", f"C{k}", CROSS_MEMBER), (f"C{k}", f"R{k}", CROSS_MEMBER)]
    last = N_SECTION - 1
    beams += [(f"L{last}", f"R{last}", CROSS_MEMBER), ("C1", "C3", CROSS_MEMBER)]
    for joint, place in places_of(plan).items():
        near = sorted(places, key=lambda node: float(np.linalg.norm(places[node] - place)))
        beams += [(joint, node, BRACKET) for node in near[:3]]
    trim = dict.fromkeys(places, (16.0, 0.10))
    places |= places_of(plan)
    factors = np.exp(0.15 * generator.standard_normal(len(beams)))
    weights = np.exp(0.25 * generator.standard_normal(len(trim)))
    return frame(
        places,
        [(a, b, _scaled(section, c)) for (a, b, section), c in zip(beams, factors, strict=True)],
        {node: (w * mass, r) for (node, (mass, r)), w in zip(trim.items(), weights, strict=True)},
        dict.fromkeys(("L1", "R1", "L4", "R4"), 2.5e4),
        BODY_LOSS,
    )


def _scaled(section: Section, factor: float) -> Section:
    return replace(section, bending=factor * section.bending, torsion=factor * section.torsion)


def draw_cabins(generator: np.random.Generator) -> dict[str, Cabin]:
    """Draw the air of one cabin, heard at every ear."""
    areas = 0.25 * np.exp(0.3 * generator.standard_normal(len(PANELS)))
    areas *= np.where(generator.random(len(PANELS)) < 0.5, -1.0, 1.0)
    modes = [
        (frequency * np.exp(0.03 * generator.standard_normal()), generator.normal(0, 0.7, 8))
        for frequency in (72.0, 118.0, 135.0, 152.0)
    ]
    return {
        ear: Cabin(
            bulk_modulus=1.42e5,
            volume=3.0,
            panel_areas=areas,
            modes=tuple(CavityMode(f, 0.05, shape[:6], shape[6 + seat]) for f, shape in modes),
        )
        for seat, ear in enumerate(EARS)
    }


def heard(
    cabins: Mapping[str, Cabin], frequency: RealArray, vertical_motion: ComplexArray
) -> ComplexArray:
    """Return the pressure at every ear, (f, n_ear, ...), of the panels' motion (f, n_panel, ...).

    Motion along z [m] or per load [m/N]; pressure [Pa] or [Pa/N].
    """
    per_panel = np.stack([cabin.pressure(frequency) for cabin in cabins.values()], axis=1)
    return np.asarray(np.einsum("fep,fp...->fe...", per_panel, vertical_motion))


@dataclass(frozen=True, eq=False)
class Car:
    """A body with its cabin."""

    body: Frame
    cabins: Mapping[str, Cabin]

    def pressure(
        self, whole: Frame, frequency: RealArray, inputs: Sequence[str]
    ) -> tuple[ComplexArray, ComplexArray]:
        """Return motion of all nodes, and pressure at the ears, per load at some nodes of `whole`.

        Shapes (f, 6 n_node, 6 n_in) and (f, n_ear, 6 n_in).
        """
        moved = whole.answer(frequency, whole.nodes, inputs)
        vertical = [whole.motions([panel])[2] for panel in PANELS]
        return moved, heard(self.cabins, frequency, moved[:, vertical])


def draw_car(plan: ComponentPlan, generator: np.random.Generator) -> Car:
    """Draw a body and its cabin."""
    return Car(draw_body(plan, generator), draw_cabins(generator))


def internal_load(frequency: RealArray, generator: np.random.Generator) -> ComplexArray:
    """Draw what acts on both bearings in one run, shape (f, 12) [N, N m].

    Smooth over frequency: a force that rises with the square of speed, and one that does not, with
    phases of their own; moments as if forces acted 5 cm off.
    """
    relative = np.asarray(frequency) / 80.0
    lever = np.tile(np.repeat([1.0, 0.05], 3), 2)
    rising, level, turn = complex_normal((3, lever.size), generator)
    delay = 0.4 * generator.standard_normal(lever.size)
    phase = np.exp(1j * np.outer(relative, delay))
    return np.asarray(
        lever * phase * (6.0 * rising * relative[:, None] ** 2 + 8.0 * level + 2.0 * turn)
    )


@dataclass(frozen=True, eq=False)
class ComponentTruth:
    """The source in its first car, and what it does in a second one.

    - `source`; `first`, `second`: bodies with their cabins.
    - `stiffness` (n_joint, 3): complex, of the mounts to the second body [N/m].
    - `loads`: name of each run to the load on both bearings, (f, 12) [N, N m].
    """

    plan: ComponentPlan
    frequency: RealArray
    source: Frame
    first: Car
    second: Car
    stiffness: ComplexArray
    loads: Mapping[str, ComplexArray]

    def blocked(self, run: str) -> ComplexArray:
        """Return the force of the source on a body at rest, shape (f, 6 n_point) [N, N m].

        With its joints held, the inside of the source answers the load, and pulls at them:
        ``f = −Z_ji x_i``. Of the stated points only.
        """
        held = self.source.motions(self.plan.joints)
        inside = [k for k in range(len(self.source.mass)) if k not in held]
        load = np.zeros((self.frequency.size, len(self.source.mass)), complex)
        load[:, self.source.motions(BEARINGS)] = self.loads[run]
        whole = self.source.dynamic_stiffness(self.frequency)
        moved = np.linalg.solve(whole[:, inside][:, :, inside], load[:, inside, None])
        stated = self.source.motions(self.plan.names)
        return np.asarray(-(whole[:, stated][:, :, inside] @ moved)[:, :, 0])


RUNS = ("steady 1", "steady 2")


def draw_component(plan: ComponentPlan, frequency: RealArray, truth_seed: int) -> ComponentTruth:
    """Draw source, both cars and runs; a seed below 1 is refused."""
    check_seed(truth_seed)
    of_source, of_first, of_second, of_runs = (
        np.random.default_rng([truth_seed, purpose]) for purpose in range(4)
    )
    second = replace(plan, unmeasured_point=0.0)
    stiffness = 2.0e5 * np.exp(0.3 * of_second.standard_normal((plan.points, 3)))
    return ComponentTruth(
        plan=plan,
        frequency=np.asarray(frequency, dtype=float),
        source=draw_source(plan, of_source),
        first=draw_car(plan, of_first),
        second=draw_car(second, of_second),
        stiffness=np.asarray(stiffness * (1 + 1j * MOUNT_LOSS), np.complex128),
        loads={run: internal_load(frequency, of_runs) for run in RUNS},
    )
