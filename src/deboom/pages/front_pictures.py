"""What the driver hears of a front, and why: curves, maps, paths of peaks, designs, modes."""

from __future__ import annotations

import numpy as np
import pandas as pd

from deboom import plot
from deboom.arrays import PERCENT, ComplexArray, RealArray
from deboom.errors import InputError
from deboom.explore.choices import Pick
from deboom.pages.front import before_and_after, report_heard
from deboom.pages.platform_front import PlatformFront
from deboom.physics.rigid_body import forward_matrices
from deboom.plot.correlations import MOST
from deboom.plot.style import ACCENT, MUTED, mount_colours, mount_of, vehicle_colours
from deboom.report import Report
from deboom.vehicles.fleet import Fleet
from deboom.vehicles.limits import natural_frequencies

PEAKS = 5
"""Booming peaks whose paths are drawn: the loudest of each vehicle, the loudest vehicles first."""


def pictures_behind(report: Report, view: PlatformFront) -> None:
    """Append the pictures behind the answer, folded; each has its table."""
    report.section(
        "More pictures: peaks, maps, paths, all designs, modes",
        "Best-mean against today's mounts, without scatter.",
        folded=True,
    )
    _peaks(report, view)
    _maps(report, view)
    _paths(report, view)
    _designs(report, view)
    _distributions(report, view)
    _modes(report, view)


def heard_by_the_driver(report: Report, view: PlatformFront) -> None:
    """Show the levels at the driver's ear before and after, with their booming peaks."""
    best = view.front.pick_designs[Pick.best_mean]
    report.section(
        "What the driver hears",
        f"{view.load_case.title}. Best-mean against today's mounts, without scatter.",
    )
    report_heard(
        report,
        view.fleet,
        best,
        view.colours,
        "Sound pressure level at the driver's ear, one panel per vehicle: "
        "frequency below, engine speed above (thesis, figure 47).",
    )
    report.table("vehicles", view.fleet.vehicle_table(Pick.best_mean))


def _peaks(report: Report, view: PlatformFront) -> None:
    """Tabulate each booming peak, today and new."""
    peaks = view.fleet.peak_table(view.best)
    shown = peaks.drop(
        columns=["speed after [rpm]", "prominence before [dB]", "prominence after [dB]"]
    )
    shown.columns = [
        name.replace("before", "today").replace("after", "new") for name in map(str, shown.columns)
    ]
    report.table(
        "peaks",
        peaks,
        "Booming peaks: local maxima with a prominence of 6 dB or more, today and new. A dash: no "
        "such peak within 1.5 Hz, the level is the highest one there.",
        {"change [dB]": 1, "frequency today [Hz]": 1, "frequency new [Hz]": 1},
        shown=shown,
    )


def _maps(report: Report, view: PlatformFront) -> None:
    """Show the levels of all load cases and vehicles over speed, before, after, difference."""
    model = view.index if view.every is None else view.every
    both = np.stack([view.front.robust.space.nominal, view.front.pick_designs[Pick.best_mean]])
    ears = view.fleet.ears
    cases = {name: model.levels(both, name)[:, ears] for name in model.load_case_names}
    before, after = np.concatenate(list(cases.values()), axis=1)
    rows = [(case, vehicle) for case in cases for vehicle in view.fleet.vehicles]
    n_lines = view.fleet.frequency.size
    table = {
        "load case": np.repeat([case for case, _ in rows], n_lines),
        "vehicle": np.repeat([vehicle for _, vehicle in rows], n_lines),
        "frequency [Hz]": np.tile(view.fleet.frequency, len(rows)),
        "before [dB(A)]": before.ravel(),
        "after [dB(A)]": after.ravel(),
    }
    names = [f"{vehicle}, {case}" for case, vehicle in rows]
    report.figure(
        "level_maps",
        lambda: before_and_after(view.fleet.frequency, view.load_case.order, names, before, after),
        "SPL at the driver's ear over speed, in every load case and vehicle: today, with "
        "best-mean, and the difference (violet: quieter).",
    )
    report.table("level_maps", pd.DataFrame(table))


def _paths(report: Report, view: PlatformFront) -> None:
    """Show which paths make up the booming peaks, and how they add up at the loudest one."""
    names = list(view.stiffness_variables)
    today, best = view.front.robust.space.nominal, view.front.pick_designs[Pick.best_mean]
    rows, panels, sums = [], [], []
    changes = view.fleet.peak_changes(best)
    for vehicle in view.fleet.vehicles:
        peaks = [change.before for change in changes[vehicle] if change.before]
        split = [view.index.paths(design, vehicle).contributions for design in (today, best)]
        for peak in peaks:
            line = int(np.argmin(np.abs(view.fleet.frequency - peak.frequency)))
            both = [values[line, : len(names)] for values in split]
            shares = [_towards(values, both[0].sum()) for values in both]
            for k, name in enumerate(names):
                of = {"vehicle": vehicle, "frequency [Hz]": peak.frequency, "path": name}
                for state, values, share in zip(("today", "best-mean"), both, shares, strict=True):
                    of[f"real, {state} [Pa]"] = values[k].real
                    of[f"imaginary, {state} [Pa]"] = values[k].imag
                    of[f"share, {state} [%]"] = share[k]
                rows.append(of)
            if peak is max(peaks, key=lambda entry: entry.level):
                label = f"{vehicle}, {peak.frequency:g} Hz [%]"
                groups = {
                    state: (share, np.minimum(share, 0.0), np.maximum(share, 0.0))
                    for state, share in zip(("today", Pick.best_mean), shares, strict=True)
                }
                panels.append((peak.level, plot.IntervalPanel(label, groups)))
                sums.append((peak.level, vehicle, peak.frequency, both))
    if not rows:
        report.text("No vehicle has a booming peak today, so there is none to split into paths.")
        return
    colours = mount_colours([mount.name for mount in view.platform.mounts])
    paint = [colours[mount_of(name)] for name in names]
    loudest = [panel for _, panel in sorted(panels, key=lambda entry: -entry[0])[:PEAKS]]
    report.figure(
        "path_contributions",
        lambda: plot.interval_panels(names, loudest),
        "Share of each path in the pressure of each vehicle's loudest booming peak, in phase with "
        "today's pressure. Today's shares add up to 100 %; a path with a negative share reduces "
        "the pressure.",
    )
    _, vehicle, frequency, both = max(sums, key=lambda entry: entry[0])
    turned = np.exp(-1j * np.angle(both[0].sum()))
    report.figure(
        "vector_sum",
        lambda: plot.vector_sum(
            names,
            {name: turned * x for name, x in zip(("today", Pick.best_mean), both, strict=True)},
            paint,
        ),
        f"How the paths add up at the loudest peak, {vehicle} at {frequency:g} Hz: head to tail, "
        "dashed with today's mounts; from the origin the pressure at the driver's ear, complex "
        "peak, turned so that today's is real.",
    )
    report.table("path_contributions", pd.DataFrame(rows))


def _towards(values: ComplexArray, total: complex) -> RealArray:
    """Part of contributions along a pressure, over that pressure [%]."""
    return np.asarray(PERCENT * (values * np.conj(total)).real / abs(total) ** 2)


def _designs(report: Report, view: PlatformFront) -> None:
    """Show every evaluated design with both objectives, and the front over its variables."""
    evaluated, names, space = (
        view.front.search.evaluated,
        list(view.front.variables),
        view.front.robust.space,
    )
    level, spread = "mean level in search [dB(A)]", "sigma in search [dB]"
    columns = dict(zip((f"{name} [1]" for name in names), evaluated.designs.T, strict=True))
    columns |= {
        level: evaluated.mean_sum * view.front.per_line,
        spread: evaluated.sigma_sum * view.front.per_line,
    }
    means = evaluated.mean[:, view.fleet.ears].T
    for vehicle, mean in zip(view.fleet.vehicles, means, strict=True):
        columns[f"{vehicle} in search [dB(A)]"] = mean / view.index.n_lines
    table = pd.DataFrame(columns)
    report.table("evaluated", table)
    shown = np.flatnonzero(~np.isin(names, view.front.without_effect))
    variables = [names[column] for column in shown]
    kept = table[np.isfinite(table[level])]
    strength = [abs(np.corrcoef(kept[f"{name} [1]"], kept[level])[0, 1]) for name in variables]
    first = [variables[k] for k in np.argsort(strength, kind="stable")[::-1][:MOST]]
    report.figure(
        "design_responses",
        lambda: plot.variable_grid(
            {name: kept[f"{name} [1]"] for name in first},
            {"level [dB(A)]": kept[level], "σ [dB]": kept[spread]},
            "",
        ),
        f"Mean and σ over the variables with the largest influence on the level, {len(kept)} "
        "designs that the search evaluated; they lie most densely where the search went.",
    )
    values = view.front.values
    report.figure(
        "parallel_coordinates",
        lambda: plot.parallel_coordinates(
            variables,
            values.designs[:, shown],
            np.stack([space.lower, space.upper])[:, shown],
            values.mean_sum * view.front.per_line,
            {name: design[shown] for name, design in view.front.named_designs.items()},
            value_label="mean level [dB(A)]",
        ),
        "The designs of the front over their variables; deboom report RUN --interactive brushes "
        "them.",
    )


def _distributions(report: Report, view: PlatformFront) -> None:
    """Show the objectives of the front by group, how sure they are, and the scatter of parts."""
    front, lines = view.front, view.index.n_lines
    level, spread = "mean level [dB(A)]", "σ [dB]"
    groups, ears = groups_of(view.runs.fleet), view.fleet.ears
    pairs = {
        name: {level: view.fleet.mean(front.values.mean[:, ears], rows) / lines}
        | {spread: view.fleet.mean(front.values.sigma[:, ears], rows) / lines}
        for name, rows in groups.items()
    }
    colours = view.colours if set(pairs) <= set(view.colours) else vehicle_colours(list(pairs))
    report.figure(
        "objectives_by_group",
        lambda: plot.grouped_pairs(pairs, {name: colours[name] for name in pairs}),
        "The designs of the front: mean and σ of each group of vehicles, of a single group "
        "of each vehicle; per_vehicle.csv has the numbers.",
    )
    names = list(front.named_designs)
    sets = front.judge.by_set(np.stack(list(front.named_designs.values())))
    strips = {
        level: np.stack([values.mean_sum for values in sets], axis=1) * front.per_line,
        spread: np.stack([values.sigma_sum for values in sets], axis=1) * front.per_line,
    }
    report.figure(
        "verification_sets",
        lambda: plot.strips(
            {label: dict(zip(names, rows, strict=True)) for label, rows in strips.items()}
        ),
        f"Verification: each dot is a set of {front.judge.n_samples} draws that the search never "
        "saw, the bar their mean.",
    )
    n_sets = len(sets)
    table = {"design": np.repeat(names, n_sets), "set": np.tile(range(1, n_sets + 1), len(names))}
    columns = {label: rows.ravel() for label, rows in strips.items()}
    report.table("verification_sets", pd.DataFrame(table | columns))
    strongest = view.telling[0]
    stiffness = f"{front.variables[strongest]} as made [1]"
    parts: dict[str, dict[str, RealArray]] = {}
    today = front.robust.space.nominal
    for name, design in (("today", today), ("best-mean", front.pick_designs[Pick.best_mean])):
        made, splv = front.judge.sets[0].made_responses(design)
        heard = view.fleet.mean(splv[:, ears]) / lines
        parts[name] = {stiffness: made[:, strongest], level: heard}
    report.figure(
        "scatter_of_parts",
        lambda: plot.joint_scatter(parts, {"today": MUTED, "best-mean": ACCENT}),
        f"The scatter of parts: {front.judge.n_samples} sets of mounts as made, the level, mean of "
        "vehicles and lines, over the stiffness that matters most. A narrow cloud means that the "
        "level depends on this stiffness alone.",
    )
    scattered = [pd.DataFrame({"design": name, **columns}) for name, columns in parts.items()]
    report.table("scatter_of_parts", pd.concat(scattered, ignore_index=True))


def groups_of(fleet: Fleet) -> dict[str, list[int]]:
    """Return the numbers of the ears of each group, of a single group that of each ear."""
    ears = [
        (vehicle.group, receiver.response_name(vehicle.name))
        for vehicle in fleet.vehicles
        for receiver in vehicle.transfers
        if receiver.is_sound
    ]
    names = [group for group, _ in ears]
    if len(set(names)) == 1:
        names = [name for _, name in ears]
    return {
        name: [place for place, of in enumerate(names) if of == name]
        for name in dict.fromkeys(names)
    }


def _modes(report: Report, view: PlatformFront) -> None:
    """Show the rigid-body modes of the powertrain in motion, with today's mounts and best-mean."""
    names = view.stiffness_variables
    both = np.stack([view.front.robust.space.nominal, view.front.pick_designs[Pick.best_mean]])
    try:
        modes = natural_frequencies(view.runs)
        frequency, shapes = modes.solved({name: both[:, k] for k, name in enumerate(names)})
    except InputError as error:
        report.text(f"The modes of the powertrain are not known: {error}.")
        return
    labels = [" ".join(filter(None, (m.name, piece))) for m in modes.mounts for piece in m.pieces]
    places = np.array([place for mount in modes.mounts for place in mount.positions])
    motion = np.einsum("pxk,km->mpx", forward_matrices(places).reshape(-1, 3, 6), shapes[1])
    columns = {
        f"{label} {axis} [1]": motion[:, row, k]
        for row, label in enumerate(labels)
        for k, axis in enumerate("xyz")
    }
    titles = [f"{new:.1f} Hz (today {old:.1f})" for old, new in zip(*frequency, strict=True)]
    report.figure(
        "modes",
        lambda: plot.mode_shapes(
            plot.BodyMotion(labels, places, np.zeros_like(places), titles, motion)
        ),
        "The powertrain's rigid-body modes with best-mean, in motion at the mounts.",
    )
    table = {"mode": range(1, 7), "today [Hz]": frequency[0], "best-mean [Hz]": frequency[1]}
    report.table("modes", pd.DataFrame({**table, **columns}))
