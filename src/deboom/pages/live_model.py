"""The booming model as numbers that a page computes with: `model.js` reads what this lays out."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from deboom.arrays import ComplexArray, IntArray, RealArray
from deboom.errors import InputError
from deboom.explore.moments import Limit
from deboom.explore.robust import Robust
from deboom.explore.scatter import ToleranceSample, sobol_sample
from deboom.explore.space import DesignSpace
from deboom.physics.order_tracking import rpm_of_frequency
from deboom.physics.sound_level import REFERENCE_PRESSURE, a_weighting
from deboom.plot.style import mount_colours, vehicle_colours
from deboom.report.live import MAX_MODEL_BYTES, LiveModel
from deboom.vehicles.amplitude_motion import AmplitudeMotion
from deboom.vehicles.booming_model import BoomingModel, Motion
from deboom.vehicles.coupled_motion import Body, CoupledMotion, FlexibleMotion
from deboom.vehicles.design_factor import Factor
from deboom.vehicles.fleet import LOSS_SUFFIX, Fleet, PathContributions
from deboom.vehicles.fleet_front import sound_rows
from deboom.vehicles.kernels import Case
from deboom.vehicles.limits import (
    MountRequirements,
    NaturalFrequencies,
    TorqueTravel,
    WeightSag,
    mount_price,
)
from deboom.vehicles.platform import MountSource, Platform, Runs
from deboom.vehicles.powertrain import MonotoneCurve, mount_forward

NOT_LIVE = (
    "its stiffnesses follow the amplitude, or its parts settle elsewhere: such a model needs the "
    "response surfaces of the mounts at every line, which no page carries"
)
MOST_DRAWS = 128
"""Draws of the scatter in a page: the band of more would not follow a slider."""


@dataclass(frozen=True, eq=False)
class LiveCase:
    """A load case of a page.

    - `case`: with its model of the motion; `weight`: in the mean level [1].
    - `title`: in words; `order`: of the engine, for the axis of speeds [1].
    """

    case: Case
    weight: float
    title: str
    order: float


def live_model(
    cases: Sequence[LiveCase],
    space: DesignSpace,
    scatter: RealArray,
    price: MountRequirements | None = None,
) -> LiveModel:
    """Lay out a booming model for a page.

    Parameters
    ----------
    cases : sequence of LiveCase
        Load cases of the same vehicles, lines and variables; all with prescribed, or all with
        coupled motion. A page with coupled motion shows the prescribed one too.
    space : DesignSpace
        Stiffness factors, then loss factors if the cases have them.
    scatter : array, shape (n_draws, k)
        Standard-normal scatter of the variables, such as ``robust.scatter(space.nominal)`` [1].
    price : MountRequirements, optional
        Sag, travel and modes of the mounts.

    Raises
    ------
    InputError
        Stiffnesses that follow the amplitude, or parts that settle elsewhere; a space with
        absolute tolerances or other distributions.

    Examples
    --------
    >>> import deboom
    >>> model = deboom.read_platform("u06").model(vehicles="U06", motion="coupled")
    >>> robust = deboom.Robust(model, model.design_space(), draws=128)
    >>> case = LiveCase(model.cases[0], 1.0, "5th gear", 1.5)
    >>> live_model([case], robust.space, robust.scatter(robust.space.nominal)).header["nSprings"]
    11
    """
    first = cases[0].case
    if any(isinstance(shown.case, AmplitudeMotion) for shown in cases):
        raise InputError(f"the model is not in the page: {NOT_LIVE}")
    if not space.is_relative_normal:
        raise InputError(
            "the model is not in the page: it scatters factors by fractions of their value, "
            "normally and cut; leave out absolute and distribution of the space"
        )
    loss = first.variable_names[-1].endswith(LOSS_SUFFIX)
    n_stiffness = len(first.variable_names) // (2 if loss else 1)
    lines = first.frequency
    weighting = a_weighting(lines)
    header: dict[str, Any] = {
        "nLines": lines.size,
        "nVehicles": len(first.vehicle_names),
        "nStiffness": n_stiffness,
        "nDraws": len(scatter),
        "lossFactors": loss,
        "variables": list(first.variable_names),
        "tolerance": float(np.max(space.tolerance)),
        "cases": [
            {
                "name": shown.case.load_case,
                "title": shown.title,
                "weight": shown.weight,
                "order": shown.order,
                "speed": rpm_of_frequency(lines, shown.order).tolist(),
            }
            for shown in cases
        ],
    }
    arrays: dict[str, RealArray] = {
        "frequency": lines,
        # 20 lg(|p| / (√2 p0)) + A = 10 lg |p|² + offset
        "offset": weighting - 20.0 * np.log10(np.sqrt(2.0) * REFERENCE_PRESSURE),
        "energyWeight": 10.0 ** (weighting / 10.0),
        "draws": scatter,
        "sigma": space.relative_sigma,
        "lower": space.lower,
        "upper": space.upper,
    }
    motions = [shown.case for shown in cases if isinstance(shown.case, CoupledMotion)]
    if motions:
        words, numbers = _springs(motions, n_stiffness, loss=loss)
    else:
        heard = [shown.case for shown in cases if isinstance(shown.case, PathContributions)]
        words, numbers = _contributions(heard, n_stiffness)
    paid, curves = (None, {}) if price is None else _price(price)
    return LiveModel({**header, **words, "price": paid}, {**arrays, **numbers, **curves})


@dataclass(frozen=True, eq=False)
class Start:
    """A design that sliders can start from: its name, and its factors (k,) [1]."""

    name: str
    design: RealArray


def _coloured(
    platform: Platform, fleet: Fleet, ears: Sequence[str]
) -> dict[str, list[dict[str, str]]]:
    """Name mounts and ears for the header of a page, with the colours of the figures."""
    vehicle_of = dict(zip(fleet.response_names, fleet.vehicle_of, strict=True))
    vehicles = [(name, fleet.vehicles[vehicle_of[name]]) for name in ears]
    colours = vehicle_colours(platform.fleet.names)
    by_mount = mount_colours([mount.name for mount in platform.mounts])
    return {
        "mounts": [
            {"name": mount.name, "words": mount.description, "colour": by_mount[mount.name]}
            for mount in platform.mounts
        ],
        "vehicles": [
            {"name": name, "group": vehicle.group, "colour": colours[vehicle.name]}
            for name, vehicle in vehicles
        ],
    }


def live_page(
    robust: Robust,
    runs: Runs,
    starts: Sequence[Start],
    words: Mapping[str, Any],
    only: Sequence[str] = (),
) -> tuple[LiveModel | None, str]:
    """Return the model of a page with everything that it shows, or why there is none.

    - `robust`: booming model and its scatter; a sample of its own for every design is replaced by
      Sobol draws that all designs share, and of more than `MOST_DRAWS` the first count.
    - `runs`: platform and load cases; further load cases of the platform are in the page with
      weight 0, as far as their data allow it.
    - `starts`: designs to start from; the first one is shown first.
    - `words`: of the run, for the header.
    - `only`: names of the vehicles of the page; none: all of the model.
    - raises InputError: a vehicle that the model does not have.
    """
    model, space = robust.evaluate, robust.space
    assert isinstance(model, BoomingModel)
    ears = [model.response_names[row] for row in sound_rows(model)]
    unknown = [name for name in only if name not in ears]
    if unknown:
        raise InputError(
            f"--vehicle {unknown[0]}: the run has no such vehicle; use one of {', '.join(ears)}"
        )
    if any(isinstance(case, AmplitudeMotion) for case in model.cases):
        return None, f"No sliders for this model: {NOT_LIVE}. Its designs are below."
    names = tuple(name for name in ears if not only or name in only)
    rows = np.array([model.response_names.index(name) for name in names])
    owner = dict(zip(runs.fleet.response_names, runs.fleet.vehicle_of, strict=True))
    kept = dict.fromkeys(owner[name] for name in names)
    heard = replace(runs, fleet=Fleet(tuple(runs.fleet.vehicles[number] for number in kept)))
    cases, no_cases = _cases(model, heard, names)
    scatter = robust.scatter(space.nominal)
    if not isinstance(robust.sample, ToleranceSample):
        sample = sobol_sample(robust.n_draws, MOST_DRAWS, seed=robust.sample.seed)
        scatter = replace(robust, sample=sample).scatter(space.nominal)
    price, no_price = None, ""
    try:
        price = mount_price(runs, Factor.dynamic)
    except InputError as error:
        no_price = f"No sag, travel and modes: {error}."
    vibrations = [name for name in model.response_names if name not in ears]
    unheard = f"not in this page: {'; '.join(vibrations)}" if vibrations else ""
    live = live_model(cases, space, scatter[:MOST_DRAWS], price)
    coupled = isinstance(cases[0].case, CoupledMotion)
    both = coupled and not model.loss_factors
    live = live.with_header(
        {
            **words,
            "notes": {"cases": no_cases, "price": no_price, "vibration": unheard},
            "limits": _limits(robust, names, price),
            "motion": model.motion.value,
            "motions": ["coupled", "prescribed"] if both else [model.motion.value],
            "starts": [{"name": start.name, "design": start.design.tolist()} for start in starts],
            "vehicleWeights": robust.weight_ratios[rows].tolist(),
            **_coloured(runs.platform, heard.fleet, names),
        }
    )
    if live.n_bytes <= MAX_MODEL_BYTES:
        return live, ""
    fit = int(len(names) * MAX_MODEL_BYTES / live.n_bytes)
    return None, (
        f"No sliders for {len(names)} vehicles: their model takes {live.n_bytes / 1e6:.1f} MB, a "
        f"page carries at most {MAX_MODEL_BYTES / 1e6:.0f}. Write it with {fit} of them: deboom "
        "report RUN --interactive --vehicle NAME --vehicle NAME …"
    )


def _limits(
    robust: Robust, vehicles: Sequence[str], price: MountRequirements | None
) -> dict[str, Any]:
    """Lay out the limits of a run: those that a page judges, and all others in words.

    - `vehicles`, `price`: those of the page.
    """
    mounts: dict[str, dict[str, float]] = {}
    means: dict[str, float] = {}
    unjudged: list[str] = []
    limits = robust.limits
    for row, (limit, stated) in enumerate(zip(limits.limits, limits.stated, strict=True)):
        heard = _of_mean_levels(robust, limit, vehicles)
        if price is not None and _is_of_price(limit, price):
            ends = mounts.setdefault(limit.number.name, {})
            for side, bound, tighter in (
                ("at_least", float(limit.at_least), max),
                ("at_most", float(limit.at_most), min),
            ):
                if np.isfinite(bound):
                    ends[side] = tighter(bound, ends.get(side, bound))
        elif heard:
            # where none is stated, the page takes today's level
            if not stated.needs_today:
                most = float(limit.at_most) / limit.n_lines
                means |= {name: min(most, means.get(name, np.inf)) for name in heard}
        else:
            sides_of_row = np.flatnonzero(limits.rows == row)
            unjudged += [limits.in_words(int(side)) for side in sides_of_row]
    return {"mounts": mounts, "mean": means, "unjudged": unjudged}


def _is_of_price(limit: Limit, price: MountRequirements) -> bool:
    """Say whether a limit is of a number of the page's price, computed alike."""
    number, requirements = limit.number, limit.number.response
    if not (number.is_of_design and isinstance(requirements, MountRequirements)):
        return False
    (quantity,) = requirements.quantities
    alike = getattr(quantity, "factor", Factor.dynamic) is Factor.dynamic
    return alike and number.name in price.response_names


def _of_mean_levels(robust: Robust, limit: Limit, vehicles: Sequence[str]) -> list[str]:
    """Return the vehicles of a page whose mean level a limit bounds from above; none of others."""
    number, every = limit.number, robust.evaluate.response_names
    if number.statistic != "mean" or robust.nominal_mean or np.isfinite(float(limit.at_least)):
        return []
    if number.response is None and number.worst:
        return list(every) if set(every) <= set(vehicles) else []
    return [
        name for name in vehicles if isinstance(number.response, str) and name == number.response
    ]


def _cases(model: BoomingModel, runs: Runs, ears: Sequence[str]) -> tuple[list[LiveCase], str]:
    """Return the load cases of the model and the platform's others with weight 0, or why not them.

    Where the motion is prescribed and the data allow the coupled one, its cases stand for both.
    """
    motion = model.motion
    mine: Sequence[Case] = model.cases
    if motion is Motion.prescribed and not model.loss_factors and not runs.not_coupled:
        motion = Motion.coupled
        wanted = [(runs.platform.load_case(name), 1.0) for name in model.load_case_names]
        mine = replace(runs, cases=wanted).model(motion).cases
    others: Sequence[Case] = ()
    refusal = ""
    missing = [c.name for c in runs.platform.load_cases if c.name not in model.load_case_names]
    source = MountSource.library_inside if runs.parts else MountSource.spectra
    if missing:
        try:
            more = runs.platform.runs(missing, fleet=runs.fleet, mounts=source, band=runs.band)
            others = more.model(motion, loss_factors=model.loss_factors).cases
        except InputError as error:
            refusal = f"{', '.join(missing)}: not in this page, because {error}."
    weights = [*model.weights, *(0.0 for _ in others)]
    described = []
    for case, weight in zip([*mine, *others], weights, strict=True):
        stated = runs.platform.load_case(case.load_case)
        heard = _heard_in(case, ears)
        described.append(LiveCase(heard, weight, stated.title, stated.order))
    return described, refusal


def _heard_in(case: Case, ears: Sequence[str]) -> Case:
    """Return a load case at some of its ears."""
    names, rows = tuple(ears), np.array([case.vehicle_names.index(name) for name in ears])
    if isinstance(case, PathContributions):
        return replace(case, values=case.values[rows], vehicle_names=names)
    bodies = tuple(replace(body, transfer=body.transfer[rows]) for body in case.bodies)
    if isinstance(case, FlexibleMotion):
        body_of = case.body_of[rows]
        return replace(case, bodies=bodies, vehicle_names=names, body_of=body_of)
    return replace(case, bodies=bodies, vehicle_names=names)


def _contributions(
    cases: Sequence[PathContributions], n_stiffness: int
) -> tuple[dict[str, Any], dict[str, RealArray]]:
    """Lay out contributions to the pressure per unit factor; a column of each is a path."""
    stacked = np.stack([case.values for case in cases])
    columns = np.flatnonzero(stacked.any(axis=(0, 1, 2)))
    variable = columns % n_stiffness
    words = {
        "nSprings": 0,
        "nEnds": 0,
        "nPerches": 0,
        "nPaths": columns.size,
        "springVariable": [],
        "springPath": [],
        "perch": [],
        "pathVariable": variable.tolist(),
        "pathLossy": (columns >= n_stiffness).tolist(),
        "silent": [k not in variable for k in range(n_stiffness)],
    }
    numbers: dict[str, RealArray] = {name: np.empty(0) for name in ("mass", "endMass", "forward")}
    for c, case in enumerate(cases):
        numbers |= _complex(f"y@{c}", np.moveaxis(case.values[..., columns], 0, 1))
    return words, numbers


def _springs(
    cases: Sequence[CoupledMotion], n_stiffness: int, *, loss: bool
) -> tuple[dict[str, Any], dict[str, RealArray]]:
    """Lay out springs of powertrain and wheel ends with their loads and the paths they feed."""
    first = cases[0]
    powertrain, *ends = (_whole(body) if loss else body for body in first.bodies)
    variable = np.concatenate([body.variables for body in (powertrain, *ends)])
    transfer = np.concatenate([body.transfer for body in (powertrain, *ends)], axis=2)
    path, heard = _paths(variable, transfer)
    perch: IntArray = np.empty(0, dtype=np.intp)
    numbers: dict[str, RealArray] = {
        "mass": powertrain.mass_matrix,
        "endMass": np.array([float(end.mass_matrix[0, 0]) for end in ends]),
        "forward": powertrain.forward,
        **_complex("y", np.moveaxis(heard, 0, 1)),
    }
    n_perches = 0
    if isinstance(first, FlexibleMotion):
        at = _elastic(first) if loss else np.arange(variable.size)
        receptance = first.receptance[first.body_of][:, :, at][..., at]
        perch, shared = _perches(receptance)
        n_perches = len(shared)
        upper = np.triu_indices(n_perches)
        of_pairs = receptance[:, :, shared][..., shared][:, :, upper[0], upper[1]]
        numbers |= _complex("receptance", np.moveaxis(of_pairs, 0, 1))
    for c, case in enumerate(cases):
        bodies = [_whole(body) if loss else body for body in case.bodies]
        numbers |= _complex(f"k@{c}", np.hstack([body.stiffness for body in bodies]))
        numbers |= _complex(f"load@{c}", np.hstack([body.load for body in bodies]))
    words = {
        "nSprings": variable.size,
        "nEnds": len(ends),
        "nPerches": n_perches,
        "nPaths": heard.shape[2],
        "springVariable": variable.tolist(),
        "springPath": path.tolist(),
        "perch": perch.tolist(),
        "pathVariable": [int(variable[path == p][0]) for p in range(heard.shape[2])],
        "pathLossy": [False] * heard.shape[2],
        "silent": [k not in variable for k in range(n_stiffness)],
    }
    return words, numbers


def _whole(body: Body) -> Body:
    """Join the elastic and the lossy half of the springs of a body again."""
    n = body.variables.size // 2
    return replace(
        body,
        forward=body.forward[:n],
        stiffness=body.stiffness[:, :n] + body.stiffness[:, n:],
        variables=body.variables[:n],
        transfer=body.transfer[..., :n],
    )


def _elastic(motion: CoupledMotion) -> IntArray:
    """Return the columns of the elastic halves of all springs."""
    columns, start = [], 0
    for body in motion.bodies:
        columns.append(np.arange(start, start + body.variables.size // 2))
        start += body.variables.size
    return np.concatenate(columns)


def _paths(variable: IntArray, transfer: ComplexArray) -> tuple[IntArray, ComplexArray]:
    """Return the path of each spring (-1: none) and the transfers (v, f, path).

    Springs of one variable that are heard alike, such as two pieces, share a path.
    """
    path = np.full(variable.size, -1)
    columns: dict[tuple[int, bytes], int] = {}
    for spring in np.flatnonzero(transfer.any(axis=(0, 1))):
        key = (int(variable[spring]), transfer[..., spring].tobytes())
        path[spring] = columns.setdefault(key, len(columns))
    first = [int(np.argmax(path == number)) for number in range(len(columns))]
    return path, transfer[..., first]


def _perches(receptance: ComplexArray) -> tuple[IntArray, list[int]]:
    """Return the perch of each spring, and a spring of each: springs on one move alike."""
    perch = np.empty(receptance.shape[2], dtype=np.intp)
    rows: dict[bytes, int] = {}
    for spring in range(perch.size):
        perch[spring] = rows.setdefault(receptance[:, :, spring].tobytes(), len(rows))
    return perch, [int(np.argmax(perch == number)) for number in range(len(rows))]


def _complex(name: str, values: ComplexArray) -> dict[str, RealArray]:
    """Split complex numbers; of ``k@1`` come ``kRe1`` and ``kIm1``."""
    stem, _, number = name.partition("@")
    return {f"{stem}Re{number}": values.real, f"{stem}Im{number}": values.imag}


def _price(price: MountRequirements) -> tuple[dict[str, Any], dict[str, RealArray]]:
    """Lay out what mounts pay for being quiet, in the order of its numbers."""
    quantities = price.quantities
    modes = next(quantity for quantity in quantities if isinstance(quantity, NaturalFrequencies))
    directions = [name for m in modes.mounts for _ in m.pieces for name in m.variables]
    names = price.variable_names
    words: dict[str, Any] = {
        "names": list(price.response_names),
        "units": [quantity.unit for quantity in quantities for _ in quantity.names],
        "variables": [names.index(name) if name in names else -1 for name in directions],
        "sagRows": 0,
        "travelColumns": [],
    }
    numbers: dict[str, RealArray] = {
        "priceForward": mount_forward(modes.mounts),
        "priceMass": modes.powertrain.mass_matrix,
        "priceStiffness": np.array([modes.stiffness[name] for name in directions]),
    }
    for quantity in quantities:
        if isinstance(quantity, WeightSag):
            forward, tangents, load = quantity.linear
            down = forward[[quantity.model.column(f"{mount} z") for mount in quantity.mounts]]
            numbers |= {"sagForward": down, "sagTangents": tangents, "sagLoad": load}
            words["sagRows"] = len(down)
        elif isinstance(quantity, TorqueTravel):
            springs = quantity.model.springs
            distinct = list(dict.fromkeys(springs))
            words |= {
                "torque": quantity.wheel_torque,
                "travelColumns": [quantity.model.column(name) for name in quantity.directions],
                "curveOf": [distinct.index(spring) for spring in springs],
                "curves": [_ends(spring) for spring in distinct],
            }
            for c, spring in enumerate(distinct):
                numbers |= {f"curveAt{c}": spring.nodes, f"curveBy{c}": spring.cubics}
        elif quantity is not modes:
            raise TypeError(f"the interactive page cannot compute {', '.join(quantity.names)}")
    return words, numbers


def _ends(spring: MonotoneCurve) -> dict[str, float]:
    return {
        "lowest": spring.lowest,
        "highest": spring.highest,
        "first": spring.first_secant,
        "last": spring.last_secant,
        "least": spring.least_slope,
    }
