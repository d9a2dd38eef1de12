"""The interactive page of a front study's finished run."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd

from deboom.arrays import RealArray
from deboom.errors import InputError
from deboom.explore.choices import Pick
from deboom.explore.front import VERIFICATION, interval_of_scrambles
from deboom.explore.robust import Robust
from deboom.explore.selection import at_nominal
from deboom.files.disk import read_bytes
from deboom.files.front_run import FleetModel
from deboom.files.front_table import FrontTable
from deboom.files.run_folder import RunEntry
from deboom.files.tables import read_frame
from deboom.names import path_inside
from deboom.pages.live_model import Start, live_page
from deboom.pages.supplier_study import SupplierStudy
from deboom.physics.dynamic_stiffness import N_PER_MM
from deboom.physics.order_tracking import rpm_of_frequency
from deboom.physics.sound_level import RUN_UP_SECONDS, full_scale
from deboom.plot.style import ACCENT, MUTED, mount_colours, mount_of, vehicle_colours
from deboom.report.interactive import Axis, InteractiveFront
from deboom.report.report import Picture
from deboom.tabled import PACKED
from deboom.vehicles.fleet_front import sound_rows
from deboom.vehicles.free_directions import Need
from deboom.vehicles.receivers import car_of

DOE, EVALUATED = "doe.csv", "evaluated.csv"
_PICTURES = {
    "pareto_front": ("Mean level and scatter of all designs.", "The front, today's and the picks."),
    "spl_curves": ("SPL of each vehicle over speed.", "Before, and in the quietest design."),
    "stiffness_bars": ("Stiffness of each mount and axis.", "Stiffnesses of the quietest design."),
}
"""File stem → words for those who cannot see it, caption."""


def interactive_front(study: SupplierStudy, vehicles: Sequence[str] = ()) -> InteractiveFront:
    """Gather what the page shows: verified figures of the run, levels of its model built again.

    - `vehicles`: those whose levels the page computes; none: all that the run served.
    """
    entry, space, index = study.run.entry, study.space, study.index
    front = study.run.front
    load_case, _ = study.load_cases[0]
    frequency = np.asarray(index.frequency)
    designs = at_nominal(study.run.designs, space, study.without_effect)
    fleet = vehicle_colours(study.platform.fleet.names)
    ears = sound_rows(index)
    scale = full_scale(index.pressure(np.stack([space.nominal, study.picked]))[:, ears])
    of_picks = [row for row, pick in enumerate(front.pick_names) if pick]
    starts = [
        Start(front.pick_names[row].replace(" = ", " and "), designs[row]) for row in of_picks
    ]
    starts.sort(key=lambda start: Pick.best_mean.value not in start.name)
    if study.pick is Pick.best_mean:
        starts[0] = replace(starts[0], design=study.freedom.with_todays_parts(starts[0].design))
    nominal = _nominal(study)
    newtons = [nominal.get(name, float("nan")) for name in space.names]
    words = _words(study.run.entry, study.platform.title, newtons, scale)
    live, not_live = live_page(study.model, study.runs, starts, words, vehicles)
    return InteractiveFront(
        title="The front: explore its designs"
        if live
        else "Explore the front of mount stiffnesses",
        question=(
            f"Which design suits {', '.join(study.vehicles)} best? Brush the front, pin two "
            "designs, and read their stiffness in N/mm and their sound pressure level in dB(A)."
        ),
        run=entry.name,
        facts=_facts(study),
        axes=(
            *_variables(study, designs),
            *_objectives(study, front),
            *_vehicles(study),
        ),
        points=list(range(1, len(front.rows) + 1)),
        picks=front.pick_names,
        vehicles=study.vehicles,
        vehicle_colours=tuple(fleet[car_of(name)] for name in study.vehicles),
        frequency=frequency,
        speed=np.asarray(rpm_of_frequency(frequency, load_case.order)),
        levels=np.asarray(index.levels(np.vstack([space.nominal, designs])))[:, ears],
        pictures=_pictures(entry.folder),
        full_scale=scale,
        live=live,
        not_live=not_live,
    )


def overlaid(page: InteractiveFront, other: InteractiveFront) -> InteractiveFront:
    """Lay the front of another run over a page's; InputError where they cannot share axes."""
    for what, mine, theirs in (
        ("axes", [axis.name for axis in page.axes], [axis.name for axis in other.axes]),
        ("vehicles", list(page.vehicles), list(other.vehicles)),
        ("lines", page.frequency.tolist(), other.frequency.tolist()),
    ):
        if mine != theirs:
            raise InputError(
                f"--beside {other.run} has other {what} than {page.run}: only runs of one "
                "platform, band and kind of variables can lie over each other"
            )
    axes = []
    for first, second in zip(page.axes, other.axes, strict=True):
        errors = [axis.errors for axis in (first, second) if axis.errors is not None]
        axes.append(
            replace(
                first,
                values=np.concatenate([first.values, second.values]),
                limits=first.limits if first.limits == second.limits else None,
                errors=np.concatenate(errors) if len(errors) == len((first, second)) else None,
            )
        )
    return replace(
        page,
        axes=tuple(axes),
        points=[*page.points, *other.points],
        picks=[*page.picks, *other.picks],
        levels=np.concatenate([page.levels, other.levels[1:]]),
        runs=[0] * len(page.points) + [1] * len(other.points),
        facts=(*page.facts, f"Beside it, in orange: run {other.run}, as its own model sees it."),
    )


def with_evaluated(page: InteractiveFront, study: SupplierStudy) -> InteractiveFront:
    """Add the designs that the search evaluated, which have values and no curves.

    Designs that could not be computed have no values; a fact of the page counts them.
    """
    if not {EVALUATED, EVALUATED + PACKED} & set(study.run.entry.record["files_sha256"]):
        return page
    every = read_frame(study.run.entry.folder / EVALUATED)
    table = every.dropna()
    columns = {"mean level": "mean level in search [dB(A)]", "σ": "sigma in search [dB]"}
    columns |= {f"{name} level": f"{name} in search [dB(A)]" for name in study.vehicles}
    columns |= {name: f"{name} [1]" for name in study.space.names}
    free, ones = study.without_effect, np.ones(len(table))
    more = {name: ones if name in free else _array(table[at]) for name, at in columns.items()}
    axes = [replace(a, values=np.concatenate([a.values, more[a.name]])) for a in page.axes]
    failed = len(every) - len(table)
    counted = f"{failed} of {len(every)} evaluated designs could not be computed and are left out."
    return replace(page, axes=tuple(axes), facts=(*page.facts, *([counted] if failed else [])))


def interactive_doe(
    entry: RunEntry, model: object, vehicles: Sequence[str] = ()
) -> InteractiveFront:
    """Gather what the page shows of designs of an experiment; failed ones are left out, counted.

    - `vehicles`: those whose levels the page computes; none: all of the run.
    """
    if not isinstance(model, FleetModel):
        raise InputError(
            f"run {entry.folder}: its study {entry.study} has no levels of a platform's vehicles: "
            "take designs of an experiment, such as those of correlation"
        )
    index, runs = model.index, model.runs
    table = read_frame(entry.folder / DOE, ("failure",))
    done = table[table["failure"].isna()]
    names = index.variable_names
    designs = done[[f"{name} [1]" for name in names]].to_numpy(float)
    today = np.ones(len(names))
    ears = sound_rows(index)
    heard = [index.response_names[ear] for ear in ears]
    means = np.asarray(index(np.vstack([today, designs])))[:, ears] / index.n_lines
    mounts = mount_colours([mount.name for mount in runs.platform.mounts])
    fleet = vehicle_colours(runs.platform.fleet.names)
    axes = [
        Axis(name, "1", x, 1.0, mounts.get(mount_of(name.removesuffix(" loss")), MUTED), "variable")
        for name, x in zip(names, designs.T, strict=True)
    ]
    whole = means.mean(axis=1)
    axes.append(Axis("mean level", "dB(A)", whole[1:], float(whole[0]), ACCENT, "objective"))
    axes += [
        Axis(f"{name} level", "dB(A)", level[1:], float(level[0]), fleet[car_of(name)], "vehicle")
        for name, level in zip(heard, means.T, strict=True)
    ]
    first = runs.platform.load_case(index.load_case_names[0])
    frequency = np.asarray(index.frequency)
    scale = full_scale(index.pressure(today[np.newaxis])[:, ears])
    stiffness = runs.stiffness(first, (float(frequency[0]), float(frequency[-1]))) * N_PER_MM
    newtons = [*stiffness.tolist(), *(np.nan for _ in names[stiffness.size :])]
    words = _words(entry, runs.platform.title, newtons, scale)
    space = index.design_space()
    lower, upper = np.vstack([space.lower, designs]), np.vstack([space.upper, designs])
    robust = Robust(index, replace(space, lower=lower.min(axis=0), upper=upper.max(axis=0)))
    live, not_live = live_page(robust, runs, (), words, vehicles)
    return InteractiveFront(
        title="The designs of the experiment" if live else "Explore the designs of an experiment",
        question=f"What does a change of the mounts do to {', '.join(heard)}?",
        run=entry.name,
        facts=(
            f"Run {entry.name} of the study {entry.study}: {len(done)} of {len(table)} designs "
            "could be computed; levels are without scatter.",
        ),
        axes=tuple(axes),
        points=done["design"].tolist(),
        picks=[""] * len(done),
        vehicles=tuple(heard),
        vehicle_colours=tuple(fleet[car_of(name)] for name in heard),
        frequency=frequency,
        speed=np.asarray(rpm_of_frequency(frequency, first.order)),
        levels=np.asarray(index.levels(np.vstack([today, designs])))[:, ears],
        full_scale=scale,
        live=live,
        not_live=not_live,
    )


def _words(
    entry: RunEntry, title: str, newtons: Sequence[float], scale: float
) -> dict[str, object]:
    """Return what the page says of its run: names, today's stiffness [N/mm], full scale [Pa]."""
    return {
        "title": f"{title}: change the mounts",
        "run": entry.name,
        "study": entry.study,
        "newtons": [value if np.isfinite(value) else None for value in newtons],
        "fullScale": scale,
        "seconds": RUN_UP_SECONDS,
    }


def _facts(study: SupplierStudy) -> tuple[str, ...]:
    first, last = study.band
    cases = study.load_cases
    weighed = ", ".join(f"{case.title} (weight {weight:.3g})" for case, weight in cases)
    many = f" The curves are those of {cases[0][0].title}." if len(cases) > 1 else ""
    tolerance = 100.0 * float(np.max(study.space.tolerance))
    return (
        f"Run {study.run.entry.name} of the study {study.run.entry.study}, seed {study.run.seed}.",
        f"{study.platform.title}: {weighed}; {first:g} to {last:g} Hz, order "
        f"{cases[0][0].order:g}.{many}",
        "Mean level and σ are verified with draws that the search never saw, parts scattered "
        f"within ±{tolerance:.0f} %, per line of the band.",
        "All levels and changes are the model's; what cars are expected to show is on the page "
        "of the run.",
        f"° {Need.nothing.value}: no vehicle depends on it, so it is left at today's value; "
        f"{Need.anything.value}: over its whole range about the best-mean, "
        f"{study.freedom.sentence}. The sliders begin with today's part where it does as well as "
        "that of the best-mean.",
    )


def _variables(study: SupplierStudy, designs: RealArray) -> list[Axis]:
    space = study.space
    nominal = _nominal(study)
    noted = (Need.anything, Need.nothing)
    needs = zip(space.names, study.freedom.needs, strict=True)
    notes = {name: need.value for name, need in needs if need in noted}
    mounts = mount_colours([mount.name for mount in study.platform.mounts])
    axes = []
    for column, name in enumerate(space.names):
        owner = name if name in nominal else name.rpartition(" ")[0]
        axes.append(
            Axis(
                name,
                space.units[column],
                designs[:, column],
                float(space.nominal[column]),
                mounts.get(mount_of(owner), MUTED),
                "variable",
                (float(space.lower[column]), float(space.upper[column])),
                nominal.get(name, float("nan")),
                notes.get(name, ""),
            )
        )
    return axes


def _nominal(study: SupplierStudy) -> dict[str, float]:
    """Stiffness of today by variable, as the run tabled it [N/mm]."""
    table = _table(study, "stiffness", ("variable", "nominal [N/mm]"))
    return dict(zip(table["variable"], _array(table["nominal [N/mm]"]).tolist(), strict=True))


def _objectives(study: SupplierStudy, front: FrontTable) -> list[Axis]:
    per_line = study.per_vehicle / len(study.index.response_names)
    interval = interval_of_scrambles(len(VERIFICATION)) * per_line
    names, rows = front.columns, front.rows
    shown = (
        ("mean level", "dB(A)", names.mean_sum, "mean level [dB(A)]", names.mean_error),
        ("σ", "dB", names.sigma_sum, "sigma of the level [dB]", names.sigma_error),
    )
    picks = _table(study, "picks", ("design", *(column for *_, column, _ in shown)))
    today = picks[picks["design"] == "baseline"]
    return [
        Axis(
            name,
            unit,
            _array(rows[total]) * per_line,
            _array(today[column])[0],
            ACCENT,
            "objective",
            errors=_array(rows[error]) * interval if error in rows else None,
        )
        for name, unit, total, column, error in shown
    ]


def _vehicles(study: SupplierStudy) -> list[Axis]:
    level = "mean level of the lines [dB(A)]"
    table = _table(study, "per_vehicle", ("point", "vehicle", level))
    before = _table(study, "vehicles", ("vehicle", "level before [dB(A)]"))
    today = dict(zip(before["vehicle"], _array(before["level before [dB(A)]"]), strict=True))
    colours = vehicle_colours(study.platform.fleet.names)
    axes = []
    for name in study.vehicles:
        values = _array(table.loc[table["vehicle"] == name, level])
        axes.append(
            Axis(f"{name} level", "dB(A)", values, today[name], colours[car_of(name)], "vehicle")
        )
    return axes


def _array(column: pd.Series) -> RealArray:
    return column.to_numpy(float)


def _table(study: SupplierStudy, stem: str, columns: tuple[str, ...]) -> pd.DataFrame:
    """Read a table of the run, whose hash has been checked."""
    path = path_inside(study.run.entry.folder, f"{stem}.csv")
    names = ("vehicle", "variable", "design")
    is_written = path.is_file() or path.with_name(path.name + PACKED).is_file()
    table = read_frame(path, names) if is_written else pd.DataFrame()
    missing = [name for name in columns if name not in table.columns]
    if missing:
        raise InputError(
            f"{path} has no column '{missing[0]}', which the interactive page shows: it needs the "
            "run of a study such as front"
        )
    return table


def _pictures(folder: Path) -> tuple[Picture, ...]:
    path_of = {stem: folder / "figures" / f"{stem}.png" for stem in _PICTURES}
    return tuple(
        Picture(read_bytes(path), *_PICTURES[stem])
        for stem, path in path_of.items()
        if path.is_file()
    )
