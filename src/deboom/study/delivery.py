"""A delivery against its acceptance box: parts, batches, and the cars that they will make."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from enum import Enum

import numpy as np

from deboom.arrays import RealArray
from deboom.errors import InputError
from deboom.explore.predicted_pieces import fewest_pieces, predicted_pieces
from deboom.explore.process_capability import Capability, capability
from deboom.explore.solution_box_share import box_sample
from deboom.files.delivered_parts import DeliveredPart
from deboom.files.platform import Platform
from deboom.files.solution_box import AcceptanceBox, BoxVariable
from deboom.report.style import mount_of
from deboom.study.motion import Motion, motion_index
from deboom.study.mount_source import MountSource, operation
from deboom.study.platform_hash import platform_sha256
from deboom.study.solution_box_question import Quantity, limited_response

PROCESSES, CARS = 100, 256
"""Processes that a batch may come from, and cars of each, for the predicted levels."""
INTERVAL = (0.05, 0.95)
"""Of predicted shares [1]."""
CONFIDENCE = 0.95
"""Of the lower bounds of Cp and Cpk [1]."""


class Verdict(Enum):
    """What the measurement says of a part or a batch."""

    passed = "pass"
    failed = "fail"
    undecided = "undecided"


@dataclass(frozen=True)
class JudgedPart:
    """One part against the intervals of its mount.

    Parameters
    ----------
    part : DeliveredPart
    factors : mapping of str to float
        Axis → stiffness over the reference [1].
    axes : mapping of str to Verdict
        Limited axis → what its stiffness says.
    reason : str
        Which axis is outside, or too near to an end; empty where it passes.
    """

    part: DeliveredPart
    factors: Mapping[str, float]
    axes: Mapping[str, Verdict]
    reason: str

    @property
    def verdict(self) -> Verdict:
        """Failed with one axis, passed with all."""
        found = set(self.axes.values())
        for verdict in (Verdict.failed, Verdict.undecided):
            if verdict in found:
                return verdict
        return Verdict.passed


@dataclass(frozen=True)
class Share:
    """A share, over what the process behind a batch may be.

    Parameters
    ----------
    middle, low, high : float
        Median and ends of `INTERVAL` [1].
    """

    middle: float
    low: float
    high: float

    @classmethod
    def of(cls, shares: RealArray) -> Share:
        """Summarise the shares of all processes, shape (n_processes,)."""
        low, middle, high = np.quantile(shares, [INTERVAL[0], 0.5, INTERVAL[1]])
        return cls(float(middle), float(low), float(high))


@dataclass(frozen=True, eq=False)
class Cars:
    """Cars that get their mounts from a batch.

    Parameters
    ----------
    levels : array, shape (n_processes, n_cars, n_vehicles)
        [unit of the box].
    within : Share
        Of parts and vehicles within the limit, as the box counts them.
    """

    levels: RealArray
    within: Share


@dataclass(frozen=True, eq=False)
class Batch:
    """Parts of one mount from one batch.

    Parameters
    ----------
    name, mount : str
    parts : tuple of JudgedPart
    capabilities : mapping of str to Capability
        Limited axis → capability; empty for a single part.
    pieces : Share or None
        Of the batch's pieces, measured or not, inside of all intervals; None where too few were
        measured to say so.
    cars : Cars or None
        None without a platform as well.
    share_stated : float
        Asked of the pieces [1].
    """

    name: str
    mount: str
    parts: tuple[JudgedPart, ...]
    capabilities: Mapping[str, Capability]
    pieces: Share | None
    cars: Cars | None
    share_stated: float

    @property
    def counts(self) -> dict[Verdict, int]:
        """Parts by verdict."""
        return {verdict: sum(part.verdict is verdict for part in self.parts) for verdict in Verdict}

    @property
    def verdict(self) -> Verdict:
        """Failed with a part outside; passed if all pass and enough pieces beyond doubt will."""
        if self.counts[Verdict.failed]:
            return Verdict.failed
        proven = self.pieces is not None and self.pieces.low >= self.share_stated
        if proven and not self.counts[Verdict.undecided]:
            return Verdict.passed
        return Verdict.undecided

    @property
    def reason(self) -> str:
        """Why it is not passed, and what the cars are warned of; empty where all is well."""
        words = []
        if self.counts[Verdict.failed]:
            words.append(f"{self.counts[Verdict.failed]} of {len(self.parts)} parts are outside")
        elif self.counts[Verdict.undecided]:
            words.append(f"{self.counts[Verdict.undecided]} parts too near to an end to decide")
        elif self.verdict is Verdict.undecided:
            words.append("too few measured parts to speak for the others: measure more")
        if self.cars is not None and self.cars.within.high < self.share_stated:
            words.append("too few cars will keep the limit: the batch lies in a corner of the box")
        return "; ".join(words)


@dataclass(frozen=True, eq=False)
class Delivery:
    """A delivery, judged.

    Parameters
    ----------
    box : AcceptanceBox
    batches : tuple of Batch
        By mount, in the order of the table.
    uncertainty : float
        Of a measured stiffness, relative, expanded to 95 % [1].
    predicted : bool
        Whether a platform was there to predict levels.
    same_data : bool
        Whether that platform's files are those of the box.
    """

    box: AcceptanceBox
    batches: tuple[Batch, ...]
    uncertainty: float
    predicted: bool
    same_data: bool

    @property
    def parts(self) -> tuple[JudgedPart, ...]:
        """All parts."""
        return tuple(part for batch in self.batches for part in batch.parts)


def limited_axes(box: AcceptanceBox, *, over_today: bool = False) -> dict[str, tuple[str, ...]]:
    """Return the axes that a box limits, by mount.

    Parameters
    ----------
    box : AcceptanceBox
    over_today : bool
        Parts are compared with today's, not with a stiffness in N/m.

    Raises
    ------
    InputError
        A limited axis without a reference stiffness: parts cannot be held against it in N/m.
    """
    axes: dict[str, list[str]] = {}
    for variable in box.variables:
        mount, axis = mount_of(variable.name), variable.name.rpartition(" ")[2]
        axes.setdefault(mount, [])
        if not variable.required:
            continue
        if variable.reference_stiffness is None and not over_today:
            raise InputError(
                f"the box limits {variable.name}, whose stiffness nobody knows in N/mm: measure "
                "parts and today's part on one machine and give their ratio (--over-today)"
            )
        axes[mount].append(axis)
    return {mount: tuple(names) for mount, names in axes.items()}


def judged_delivery(
    box: AcceptanceBox,
    parts: Sequence[DeliveredPart],
    platform: Platform | None,
    uncertainty: float,
    seed: int,
    *,
    over_today: bool = False,
) -> Delivery:
    """Hold the parts of a delivery against a box, and predict the cars that they make.

    Parameters
    ----------
    box : AcceptanceBox
    parts : sequence of DeliveredPart
        Measured at the condition of the box.
    platform : Platform or None
        That the box was found for; None: no levels are predicted.
    uncertainty : float
        Of a measured stiffness, relative, expanded to 95 % [1].
    seed : int
        Of the predicted cars, from 1.
    over_today : bool
        Stiffnesses are over those of today's part [1].

    Returns
    -------
    Delivery

    Raises
    ------
    InputError
        An uncertainty outside 0 to 0.5; parts of a batch that do not scatter; a platform that is
        not that of the box.

    Notes
    -----
    A part passes where its stiffness, with the uncertainty to either side, lies in every interval
    of its mount; it fails where it lies outside with all of the uncertainty (ISO 14253-1). What was
    not measured of a batch follows from what was, see `predicted_pieces`. Cars of a batch have
    their mount from it and all other mounts anywhere in the box. The box promises its share for
    parts all over it: a batch in a corner may keep every interval and still make loud cars.
    """
    if not 0.0 <= uncertainty < 0.5:
        raise InputError(f"--uncertainty {uncertainty:g}: give a share from 0 to below 0.5")
    judged = [_judged(box, part, uncertainty, over_today) for part in parts]
    levels = None if platform is None else _Levels(box, platform, seed)
    names = dict.fromkeys((one.part.mount, one.part.batch) for one in judged)
    batches = []
    for mount, batch in names:
        members = tuple(one for one in judged if (one.part.mount, one.part.batch) == (mount, batch))
        axes = limited_axes(box, over_today=over_today)[mount]
        batches.append(_batch(box, (batch, mount, axes), members, levels, seed))
    return Delivery(
        box,
        tuple(batches),
        uncertainty,
        predicted=levels is not None,
        same_data=levels is None or levels.same_data,
    )


def _judged(
    box: AcceptanceBox, part: DeliveredPart, uncertainty: float, over_today: bool
) -> JudgedPart:
    factors, verdicts, words = {}, {}, []
    for axis, stiffness in part.stiffness.items():
        variable = box.variable(f"{part.mount} {axis}")
        today = 1.0 if over_today else variable.reference_stiffness
        if not variable.required or today is None:
            continue
        factor = factors[axis] = stiffness / today
        low, high = factor * (1.0 - uncertainty), factor * (1.0 + uncertainty)
        verdicts[axis] = Verdict.passed
        if high < variable.lower or low > variable.upper:
            verdicts[axis] = Verdict.failed
        elif low < variable.lower or high > variable.upper:
            verdicts[axis] = Verdict.undecided
        if verdicts[axis] is not Verdict.passed:
            words.append(_where(variable, axis, factor, verdicts[axis], over_today))
    return JudgedPart(part, factors, verdicts, "; ".join(words))


def _where(
    variable: BoxVariable, axis: str, factor: float, verdict: Verdict, over_today: bool
) -> str:
    what = "outside" if verdict is Verdict.failed else "too near to an end"
    today = None if over_today else variable.reference_stiffness
    if today is None:
        numbers = f"{factor:.3f} of today's, asked {variable.lower:.3f} to {variable.upper:.3f}"
    else:
        found, low, high = (1e-3 * today * f for f in (factor, variable.lower, variable.upper))
        numbers = f"{found:.1f} N/mm, asked {low:.1f} to {high:.1f} N/mm"
    return f"{axis} {what}: {numbers}"


def _batch(
    box: AcceptanceBox,
    which: tuple[str, str, tuple[str, ...]],
    members: tuple[JudgedPart, ...],
    levels: _Levels | None,
    seed: int,
) -> Batch:
    name, mount, axes = which
    measured = np.array([[one.factors[axis] for axis in axes] for one in members])
    variables = [box.variable(f"{mount} {axis}") for axis in axes]
    found: dict[str, Capability] = {}
    if len(members) > 1:
        for axis, variable, values in zip(axes, variables, measured.T, strict=True):
            with _naming(f"{mount} {axis}, batch {name}"):
                found[axis] = capability(values, variable.lower, variable.upper, CONFIDENCE)
    pieces, cars = None, None
    if axes and len(members) >= fewest_pieces(len(axes)):
        with _naming(f"{mount}, batch {name}"):
            drawn = predicted_pieces(measured, PROCESSES, CARS, seed=seed)
        lower = np.array([variable.lower for variable in variables])
        upper = np.array([variable.upper for variable in variables])
        pieces = Share.of(((lower <= drawn) & (drawn <= upper)).all(axis=2).mean(axis=1))
        cars = None if levels is None else levels.cars(mount, axes, drawn)
    return Batch(name, mount, members, found, pieces, cars, box.share_stated)


@contextmanager
def _naming(what: str) -> Iterator[None]:
    """Say of which parts an error is."""
    try:
        yield
    except InputError as error:
        raise InputError(f"{what}: {error}") from None


class _Levels:
    """The model behind a box; lives within one call."""

    def __init__(self, box: AcceptanceBox, platform: Platform, seed: int) -> None:
        self.box, self.seed = box, seed
        groups = {vehicle.group for vehicle in platform.fleet.vehicles}
        runs = operation(
            platform,
            [f"{name}={weight!r}" for name, weight in box.load_cases],
            MountSource(box.mounts),
            box.group if box.group in groups else None,
            box.band,
        )
        index = motion_index(runs, Motion(box.motion), None)
        wanted = [variable.name for variable in box.variables]
        vehicles = [response.name for response in box.responses]
        if list(index.variable_names) != wanted or list(index.response_names) != vehicles:
            raise InputError(
                f"platform {platform.name} has the variables {list(index.variable_names)} and the "
                f"vehicles {list(index.response_names)}, the box {wanted} and {vehicles}: give the "
                "platform that the box was found for"
            )
        by_name = {
            one.quantity: one
            for one in (limited_response(quantity, index, box.band) for quantity in Quantity)
        }
        if box.quantity not in by_name:
            raise InputError(f"the box limits '{box.quantity}', this deboom knows {list(by_name)}")
        self.response = by_name[box.quantity]
        self.same_data = platform_sha256(runs.platform) == box.platform_sha256

    def cars(self, mount: str, axes: tuple[str, ...], pieces: RealArray) -> Cars:
        """Build cars with drawn pieces of one mount, shape (n_processes, n_cars, n_axes)."""
        variables = self.box.variables
        names = [variable.name for variable in variables]
        lower, upper, nominal = np.array([(v.lower, v.upper, v.nominal) for v in variables]).T
        required = np.array([variable.required for variable in variables])
        # the other mounts are the same for every process, which tells processes apart sooner
        places = box_sample(len(names), CARS, seed=self.seed, purpose="cars of a delivery")
        designs = np.tile(lower + places * (upper - lower), (len(pieces), 1))
        designs[:, ~required] = nominal[~required]
        for place, axis in enumerate(axes):
            designs[:, names.index(f"{mount} {axis}")] = pieces[..., place].ravel()
        levels = np.asarray(self.response(designs)).reshape(len(pieces), CARS, -1)
        within = levels <= np.array([response.limit for response in self.box.responses])
        kept = within.all(axis=2) if self.box.together else within.mean(axis=2)
        return Cars(levels, Share.of(kept.mean(axis=1)))
