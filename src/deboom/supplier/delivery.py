"""A delivery against an acceptance box, or against the sheet that a supplier was sent."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from enum import Enum

import numpy as np
import pandas as pd
from scipy.stats import linregress

from deboom.arrays import RealArray
from deboom.errors import InputError
from deboom.explore.moments import CONFIDENCE
from deboom.explore.scatter import Capability, capability, fewest_pieces, predicted_pieces
from deboom.explore.space import sobol_points
from deboom.files.acceptance import (
    AcceptanceBox,
    BoxVariable,
    DeliveredPart,
    SheetDirection,
    SupplierSpecification,
    box_document,
)
from deboom.files.platform import platform_sha256
from deboom.files.supplier_words import said
from deboom.language import Language
from deboom.physics.dynamic_stiffness import N_PER_MM
from deboom.plot.style import mount_of
from deboom.tabled import Tabled
from deboom.vehicles.booming_model import Motion
from deboom.vehicles.limits import LimitedLevel, limited_response
from deboom.vehicles.platform import Platform

PROCESSES, CARS = 100, 256
"""Processes that a batch may come from, and cars of each, for the predicted levels."""
INTERVAL = (0.05, 0.95)
"""Of predicted shares [1]."""


FEWEST_BATCHES, BY_CHANCE = 4, 0.05
"""Batches that tell a drift, and the p-value of their slope from which it is none."""


class PartVerdict(Enum):
    """What the measurement says of a part or a batch."""

    passed = "pass"
    failed = "fail"
    undecided = "undecided"


class CapabilityVerdict(Enum):
    """What a sample says of the Cpk that a process must show."""

    shown = "shown"
    """The lower bound reaches it."""
    open = "open"
    missed = "missed"
    """The sample's own value lies below it."""


@dataclass(frozen=True)
class Cause:
    """Why an axis of a part does not pass.

    `what`: its key among the words of a sheet; `measured`, `lower`, `upper`: stiffness over the
    reference, and the interval [1]; `reference`: [N/m], None where parts are ratios.
    """

    axis: str
    what: str
    measured: float
    lower: float
    upper: float
    reference: float | None

    @property
    def distance(self) -> float:
        """How far the stiffness lies outside of the interval, over the reference [1]."""
        return max(self.lower - self.measured, self.measured - self.upper)

    def words(self, language: Language) -> str:
        """Say it in a language."""
        size, digits, unit = 1.0, 3, ""
        if self.reference is not None:
            size, digits, unit = N_PER_MM * self.reference, 1, " N/mm"
        measured, first, last = (
            language.local(f"{size * value:.{digits}f}")
            for value in (self.measured, self.lower, self.upper)
        )
        return said(
            "part reason",
            language,
            axis=self.axis,
            what=said(self.what, language),
            measured=measured,
            of=unit or said("of today's", language),
            first=first,
            last=last,
            unit=unit,
        )


@dataclass(frozen=True)
class JudgedPart:
    """One part against the intervals of its mount.

    `factors`, `axes`: limited axis → stiffness over the reference [1], and what it says;
    `causes`: of each axis that does not pass.
    """

    part: DeliveredPart
    factors: Mapping[str, float]
    axes: Mapping[str, PartVerdict]
    causes: tuple[Cause, ...]

    def reason(self, language: Language = Language.en) -> str:
        """Which axis is outside, or too near to an end; empty where it passes."""
        return "; ".join(cause.words(language) for cause in self.causes)

    @property
    def verdict(self) -> PartVerdict:
        """Failed with one axis, passed with all."""
        for verdict in (PartVerdict.failed, PartVerdict.undecided):
            if verdict in self.axes.values():
                return verdict
        return PartVerdict.passed


@dataclass(frozen=True)
class Share:
    """A share over what the process behind a batch may be: median and ends of `INTERVAL` [1]."""

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

    `levels`: array, shape (n_processes, n_cars, n_vehicles), in the unit of the box; `within`:
    share of cars within the limit, in all vehicles or averaged over them, as the box counts.
    """

    levels: RealArray
    within: Share


@dataclass(frozen=True, eq=False)
class Batch:
    """Parts of one mount from one batch.

    `capabilities`: limited axis → capability, empty for a single part; `pieces`: share of the
    batch's pieces, measured or not, inside of all intervals, None where too few were measured or
    no axis is limited; `cars`: None then, or without a platform; `share_stated`: asked of pieces.
    """

    name: str
    mount: str
    parts: tuple[JudgedPart, ...]
    capabilities: Mapping[str, Capability]
    pieces: Share | None
    cars: Cars | None
    share_stated: float

    @property
    def counts(self) -> dict[PartVerdict, int]:
        """Parts by verdict."""
        return {
            verdict: sum(part.verdict is verdict for part in self.parts) for verdict in PartVerdict
        }

    @property
    def not_normal(self) -> tuple[str, ...]:
        """Axes whose parts contradict the normal law that shares and bounds rest on."""
        return tuple(axis for axis, each in self.capabilities.items() if not each.normal)

    @property
    def verdict(self) -> PartVerdict:
        """Failed with a part outside; passed if all pass and enough pieces beyond doubt will.

        Of parts that contradict the normal law, nothing is known beyond those that were measured.
        """
        if self.counts[PartVerdict.failed]:
            return PartVerdict.failed
        proven = self.pieces is not None and self.pieces.low >= self.share_stated
        if proven and not self.not_normal and not self.counts[PartVerdict.undecided]:
            return PartVerdict.passed
        return PartVerdict.undecided

    def reason(self, language: Language = Language.en) -> str:
        """Why it is not passed, or that too few cars keep the limit; empty where all is well."""
        words, counts = [], self.counts
        if counts[PartVerdict.failed]:
            n, of = counts[PartVerdict.failed], len(self.parts)
            outside = [
                cause for part in self.parts for cause in part.causes if cause.what == "outside"
            ]
            furthest = max(outside, key=lambda cause: cause.distance).words(language)
            words.append(said("parts outside", language, n=n, of=of, furthest=furthest))
        elif counts[PartVerdict.undecided]:
            words.append(said("parts near", language, n=counts[PartVerdict.undecided]))
        elif self.verdict is PartVerdict.undecided and not self.not_normal:
            words.append(said("too few parts", language))
        if self.not_normal:
            words.append(said("not normal", language, axes=", ".join(self.not_normal)))
        inside = not counts[PartVerdict.failed]
        if inside and self.cars is not None and self.cars.within.high < self.share_stated:
            words.append(said("corner", language))
        return "; ".join(words)


@dataclass(frozen=True)
class Process:
    """All batches of a mount along one axis, in the order of the table.

    - `overall`: capability of all parts; its Cp and Cpk are Pp and Ppk.
    - `smallest_within`: smallest Cpk of a single batch [1].
    - `drift`: change of the mean from batch to batch, over the mean; nan of fewer than
      `FEWEST_BATCHES`, and where chance explains it [1].
    """

    mount: str
    axis: str
    n_batches: int
    overall: Capability
    smallest_within: float
    drift: float

    def words(self, language: Language) -> str:
        """Say what batch by batch does not show; empty where the batches are alike."""
        if not np.isfinite(self.drift):
            return ""
        return said(
            "drift",
            language,
            axis=f"{self.mount} {self.axis}",
            drift=language.local(f"{100 * self.drift:+.1f}"),
            n=self.n_batches,
            ppk=language.local(f"{self.overall.cpk:.2f}"),
            cpk=language.local(f"{self.smallest_within:.2f}"),
        )


@dataclass(frozen=True, eq=False)
class Demand:
    """The demands by which parts are judged.

    `title`: of the box or the sheet; `variables`: intervals; `share_stated`: asked of the pieces
    [1]; `box`: None where only a sheet is there; `sheet`: parts were measured at its states, and
    are ratios to today's part where there is no reference stiffness.
    """

    title: str
    variables: tuple[BoxVariable, ...]
    share_stated: float
    box: AcceptanceBox | None
    sheet: SupplierSpecification | None = None

    @property
    def cpk(self) -> float | None:
        """Demanded Cpk [1]; None: not demanded."""
        return None if self.sheet is None else self.sheet.cpk

    @property
    def checksum(self) -> str:
        """SHA-256 of the sheet, or of the box where there is no sheet."""
        if self.sheet is not None:
            return self.sheet.checksum
        return "" if self.box is None else str(box_document(self.box)["sha256"])

    def capability_verdict(self, measured: Capability) -> CapabilityVerdict | None:
        """Hold a capability against the demanded Cpk; None where none is demanded."""
        if self.cpk is None:
            return None
        if measured.cpk_bound >= self.cpk:
            return CapabilityVerdict.shown
        return CapabilityVerdict.open if measured.cpk >= self.cpk else CapabilityVerdict.missed

    @classmethod
    def of_box(cls, box: AcceptanceBox) -> Demand:
        """Hold parts against all intervals of a box, at the condition that it states."""
        return cls(box.title.partition(":")[0], box.variables, box.share_stated, box)

    @classmethod
    def of_sheet(cls, sheet: SupplierSpecification, box: AcceptanceBox | None) -> Demand:
        """Hold parts against the musts of a sheet, at its states.

        Raises
        ------
        InputError
            A sheet without a must; a sheet that was made with another box.
        """
        if not sheet.musts or sheet.share_stated is None:
            raise InputError(
                f"the sheet of {sheet.mount} has no must: make it with --box, from a limit that is "
                "to be kept"
            )
        made_with = "" if box is None else str(box_document(box)["sha256"])
        if box is not None and sheet.box_sha256 != made_with:
            raise InputError(
                f"the sheet of {sheet.mount} was made with the box {sheet.box_sha256[:12]}, not "
                f"with {made_with[:12]}: give the box that the sheet was made with"
            )
        variables = []
        for direction in sheet.musts.values():
            assert direction.lower is not None
            assert direction.upper is not None
            ends = direction.lower, direction.upper
            today = direction.today_n_per_mm
            variables.append(
                BoxVariable(
                    name=direction.name,
                    lower=ends[0],
                    upper=ends[1],
                    searched=ends,
                    nominal=0.5 * sum(ends),
                    reference_stiffness_n_per_m=None if today is None else 1e3 * today,
                    condition=_state(direction),
                    weight=1.0,
                    required=True,
                )
            )
        return cls(f"mount {sheet.mount}", tuple(variables), sheet.share_stated, box, sheet)

    def variable(self, name: str) -> BoxVariable:
        """Return an interval by its direction."""
        variable_of = {variable.name: variable for variable in self.variables}
        if name not in variable_of:
            raise InputError(
                f"{self.title} asks nothing of '{name}', only of {', '.join(variable_of)}"
            )
        return variable_of[name]


def _state(direction: SheetDirection) -> str:
    values = (direction.preload_n, direction.amplitude_mm, direction.frequency_hz)
    with_units = zip(values, ("N", "mm peak", "Hz"), strict=True)
    words = (f"{value:g} {unit}" for value, unit in with_units if value is not None)
    return ", ".join(words).replace("-", "−")


@dataclass(frozen=True, eq=False)
class Delivery(Tabled):
    """A delivery, judged.

    `batches`: by mount, in the order of the table; `uncertainty`: of a measured stiffness,
    relative, expanded to 95 % [1]; `predicted`: a platform was there to predict levels;
    `same_data`: that platform's files are those of the box; True without one; `assumed`: defaults
    that its levels rest on, in words.

    See Also
    --------
    deboom.judged_delivery, deboom.read_delivered_parts
    """

    demand: Demand
    batches: tuple[Batch, ...]
    uncertainty: float
    predicted: bool
    same_data: bool
    assumed: tuple[str, ...] = ()

    @property
    def parts(self) -> tuple[JudgedPart, ...]:
        """All parts."""
        return tuple(part for batch in self.batches for part in batch.parts)

    @property
    def processes(self) -> tuple[Process, ...]:
        """All batches of a mount together, by axis, where it has two batches or more."""
        processes = []
        for mount in dict.fromkeys(batch.mount for batch in self.batches):
            batches = [batch for batch in self.batches if batch.mount == mount]
            within = [batch.capabilities for batch in batches if batch.capabilities]
            if len(batches) < 2 or not within:
                continue
            for axis in within[0]:
                values = [[part.factors[axis] for part in batch.parts] for batch in batches]
                means = np.array([np.mean(each) for each in values])
                drift = float("nan")
                if len(batches) >= FEWEST_BATCHES:
                    line = linregress(np.arange(len(batches)), means)
                    drift = line.slope / means.mean() if line.pvalue < BY_CHANCE else drift
                variable = self.demand.variable(f"{mount} {axis}")
                processes.append(
                    Process(
                        mount=mount,
                        axis=axis,
                        n_batches=len(batches),
                        overall=capability(
                            np.concatenate(values), variable.lower, variable.upper, CONFIDENCE
                        ),
                        smallest_within=min(each[axis].cpk for each in within),
                        drift=float(drift),
                    )
                )
        return tuple(processes)

    @property
    def table(self) -> pd.DataFrame:
        """One row per part: stiffness, ratio to today's, verdict and reason."""
        axes = sorted({axis for judged in self.parts for axis in judged.factors})
        rows = []
        for judged in self.parts:
            part, factors = judged.part, {axis: judged.factors.get(axis, np.nan) for axis in axes}
            row: dict[str, object] = {"part": part.name, "batch": part.batch, "mount": part.mount}
            for axis, factor in factors.items():
                today = None
                if axis in judged.factors:  # other mounts may have other axes
                    today = self.demand.variable(f"{part.mount} {axis}").reference_stiffness_n_per_m
                row[f"{axis} [N/mm]"] = N_PER_MM * (np.nan if today is None else today) * factor
            row |= {f"{axis} over today's [1]": factor for axis, factor in factors.items()}
            rows.append(row | {"verdict": judged.verdict.value, "reason": judged.reason()})
        return pd.DataFrame(rows)


def limited_axes(demand: Demand, *, over_today: bool = False) -> dict[str, tuple[str, ...]]:
    """Return the axes that are limited, by mount; with `over_today`, parts are ratios to today's.

    Raises
    ------
    InputError
        A limited axis without a reference stiffness: parts cannot be judged by it in N/m.
    """
    axes: dict[str, list[str]] = {}
    for variable in demand.variables:
        mount, axis = mount_of(variable.name), variable.name.rpartition(" ")[2]
        axes.setdefault(mount, [])
        if not variable.required:
            continue
        has_reference = variable.reference_stiffness_n_per_m is not None or demand.sheet is not None
        if not has_reference and not over_today:
            raise InputError(
                f"the box limits {variable.name}, whose stiffness nobody knows in N/mm: measure "
                "parts and today's part on one machine and give their ratio (--over-today)"
            )
        axes[mount].append(axis)
    return {mount: tuple(names) for mount, names in axes.items()}


def judged_delivery(
    demand: Demand | AcceptanceBox,
    parts: Sequence[DeliveredPart],
    platform: Platform | None,
    uncertainty: float,
    seed: int,
    *,
    over_today: bool = False,
) -> Delivery:
    """Hold the parts of a delivery against what was asked, and predict the cars that they make.

    Parameters
    ----------
    demand : Demand or AcceptanceBox
        Intervals, and limits to predict levels against.
    parts : sequence of DeliveredPart
        Parts, measured at the conditions of the demand [N/m].
    platform : Platform or None
        Platform that the box was found for; None: no levels are predicted.
    uncertainty : float
        Uncertainty of a measured stiffness, relative, expanded to 95 % [1].
    seed : int
        Seed of the predicted cars, from 1.
    over_today : bool
        Stiffnesses are over those of today's part [1].

    Returns
    -------
    Delivery
        PartVerdict of each part and batch; ``table``, one row per part.

    Raises
    ------
    InputError
        An uncertainty outside 0 to 0.5; parts of a batch that do not scatter; an axis that is
        limited in N/m without a reference; a platform that is not the box's, or one without a box.

    See Also
    --------
    deboom.read_solution_box, deboom.read_delivered_parts, deboom.supplier.acceptance.Delivery

    Notes
    -----
    A part passes where its stiffness, with the uncertainty to either side, lies in every interval
    of its mount; it fails where it lies outside with all of the uncertainty (ISO 14253-1). What was
    not measured of a batch follows from what was, see `predicted_pieces`. Cars of a batch have
    their mount from it and all other mounts anywhere in the box. The box promises its share for
    parts all over it: a batch in a corner may keep every interval and still make loud cars.

    Examples
    --------
    >>> import deboom
    >>> deboom.judged_delivery(box, parts, None, 0.02, seed=1).table  # doctest: +SKIP
    """
    if isinstance(demand, AcceptanceBox):
        demand = Demand.of_box(demand)
    if not 0.0 <= uncertainty < 0.5:
        raise InputError(f"--uncertainty {uncertainty:g}: give a share from 0 to below 0.5")
    judged = [_judged(demand, part, uncertainty, over_today) for part in parts]
    if platform is not None and demand.box is None:
        raise InputError("--platform predicts levels against the limits of a box: give the box")
    levels = None
    if platform is not None and demand.box is not None:
        levels = _Levels(demand.box, platform, seed)
    names = dict.fromkeys(
        (judged_part.part.mount, judged_part.part.batch) for judged_part in judged
    )
    batches = []
    for mount, batch in names:
        members = tuple(j for j in judged if (j.part.mount, j.part.batch) == (mount, batch))
        axes = limited_axes(demand, over_today=over_today)[mount]
        batches.append(_batch(demand, (batch, mount, axes), members, levels, seed))
    return Delivery(
        demand,
        tuple(batches),
        uncertainty,
        predicted=levels is not None,
        same_data=levels is None or levels.same_data,
        assumed=() if levels is None else levels.assumed,
    )


def _judged(
    demand: Demand, part: DeliveredPart, uncertainty: float, over_today: bool
) -> JudgedPart:
    factors, verdicts, causes = {}, {}, list[Cause]()
    for axis, stiffness in part.stiffness.items():
        variable = demand.variable(f"{part.mount} {axis}")
        reference = None if over_today else variable.reference_stiffness_n_per_m
        if not variable.required:
            continue
        factor = factors[axis] = stiffness / (1.0 if reference is None else reference)
        low, high = factor * (1.0 - uncertainty), factor * (1.0 + uncertainty)
        verdict = verdicts[axis] = PartVerdict.passed
        if high < variable.lower or low > variable.upper:
            verdict = verdicts[axis] = PartVerdict.failed
        elif low < variable.lower or high > variable.upper:
            verdict = verdicts[axis] = PartVerdict.undecided
        if verdict is PartVerdict.passed:
            continue
        what = "outside" if verdict is PartVerdict.failed else "near"
        if cannot_decide(variable, uncertainty) and verdict is PartVerdict.undecided:
            what = "undecidable"
        causes.append(Cause(axis, what, factor, variable.lower, variable.upper, reference))
    return JudgedPart(part, factors, verdicts, tuple(causes))


def cannot_decide(variable: BoxVariable, uncertainty: float) -> bool:
    """Return whether no measured value passes with this uncertainty, relative [1]."""
    return variable.lower / (1.0 - uncertainty) > variable.upper / (1.0 + uncertainty)


def _batch(
    demand: Demand,
    which: tuple[str, str, tuple[str, ...]],
    members: tuple[JudgedPart, ...],
    levels: _Levels | None,
    seed: int,
) -> Batch:
    name, mount, axes = which
    for member in members:
        lacking = [axis for axis in axes if axis not in member.factors]
        if lacking:
            raise InputError(
                f"part '{member.part.name}': {mount} {lacking[0]} was not measured, and the box "
                "limits it: measure it"
            )
    measured = np.array([[member.factors[axis] for axis in axes] for member in members])
    variables = [demand.variable(f"{mount} {axis}") for axis in axes]
    capabilities: dict[str, Capability] = {}
    if len(members) > 1:
        for axis, variable, values in zip(axes, variables, measured.T, strict=True):
            with _naming(f"{mount} {axis}, batch {name}"):
                capabilities[axis] = capability(values, variable.lower, variable.upper, CONFIDENCE)
    pieces, cars = None, None
    if axes and len(members) >= fewest_pieces(len(axes)):
        with _naming(f"{mount}, batch {name}"):
            drawn = predicted_pieces(measured, PROCESSES, CARS, seed=seed)
        lower = np.array([variable.lower for variable in variables])
        upper = np.array([variable.upper for variable in variables])
        pieces = Share.of(((lower <= drawn) & (drawn <= upper)).all(axis=2).mean(axis=1))
        cars = None if levels is None else levels.cars(mount, axes, drawn)
    return Batch(name, mount, members, capabilities, pieces, cars, demand.share_stated)


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
        runs = platform.runs(
            [f"{name}={weight!r}" for name, weight in box.load_cases],
            fleet=platform.fleet.group(box.group) if box.group in groups else platform.fleet,
            mounts=box.mounts,
            band=box.band_hz,
        )
        wanted = [variable.name for variable in box.variables]
        vehicles = [response.name for response in box.responses]
        if not set(runs.fleet.response_names) <= set(vehicles):
            runs = runs.heard("the box has limits of sounds")
        index = runs.model(Motion(box.motion))
        if list(index.variable_names) != wanted or list(index.response_names) != vehicles:
            raise InputError(
                f"platform {platform.name} has the variables {list(index.variable_names)} and the "
                f"vehicles {list(index.response_names)}, the box {wanted} and {vehicles}: give the "
                "platform that the box was found for"
            )
        by_name = {
            limited.quantity: limited
            for limited in (
                limited_response(quantity, index, box.band_hz) for quantity in LimitedLevel
            )
        }
        if box.quantity not in by_name:
            raise InputError(f"the box limits '{box.quantity}', this deboom knows {list(by_name)}")
        self.response = by_name[box.quantity]
        self.same_data = platform_sha256(runs.platform) == box.platform_sha256
        self.assumed = runs.assumed

    def cars(self, mount: str, axes: tuple[str, ...], pieces: RealArray) -> Cars:
        """Build cars with drawn pieces of one mount, shape (n_processes, n_cars, n_axes)."""
        variables = self.box.variables
        names = [variable.name for variable in variables]
        lower, upper, nominal = np.array([(v.lower, v.upper, v.nominal) for v in variables]).T
        required = np.array([variable.required for variable in variables])
        # the other mounts are the same for every process, which tells processes apart sooner
        places = sobol_points(len(names), CARS, seed=self.seed, purpose="cars of a delivery")
        designs = np.tile(lower + places * (upper - lower), (len(pieces), 1))
        designs[:, ~required] = nominal[~required]
        for place, axis in enumerate(axes):
            designs[:, names.index(f"{mount} {axis}")] = pieces[..., place].ravel()
        levels = np.asarray(self.response(designs)).reshape(len(pieces), CARS, -1)
        within = levels <= np.array([response.limit for response in self.box.responses])
        kept = within.all(axis=2) if self.box.together else within.mean(axis=2)
        return Cars(levels, Share.of(kept.mean(axis=1)))
