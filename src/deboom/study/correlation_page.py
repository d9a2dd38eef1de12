"""Words and figures that the correlation studies share."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import pandas as pd

from deboom.report import figures
from deboom.report.figures.scatter_matrix import MOST
from deboom.report.page import Picture, Section, Table
from deboom.report.style import vehicle_colours
from deboom.study.correlation import CorrelationSet, CorrelationStudy, Levels

TERMS = (
    "booming noise",
    "SPL",
    "SPLV",
    "stiffness factor",
    "tolerance",
    "σ",
    "noise transfer function",
    "correlation",
    "family of vehicles",
)


def matrix_figure(sets: CorrelationSet, groups: Sequence[str] = ()) -> bytes:
    """Draw the matrices of designs, means and scatter."""
    panels = [
        figures.CorrelationPanel(kind, found.pearson, found.pearson_low, found.pearson_high)
        for kind, found in sets.kinds.items()
    ]
    return figures.correlation_matrices(sets.designs.names, panels, groups)


def scatter_figures(
    study: CorrelationStudy, levels: Levels, sets: CorrelationSet, stem: str, label: str
) -> dict[str, bytes]:
    """Draw the scatter matrices of designs and of tolerance draws; none if there are too many."""
    names = levels.names
    if len(names) > MOST:
        return {}
    colours = vehicle_colours(study.runs.platform.fleet.names)
    drawn = {
        f"{stem}_designs": (levels.designs, sets.designs, label),
        f"{stem}_tolerance": (
            levels.scatter.reshape(-1, len(names)),
            sets.scatter,
            "scatter around each design's mean [dB]",
        ),
    }
    return {
        file: figures.scatter_matrix(
            names,
            values,
            (found.pearson, found.pearson_low, found.pearson_high),
            colours,
            value_label=words,
        )
        for file, (values, found, words) in drawn.items()
    }


def family_figure(study: CorrelationStudy) -> bytes:
    """Draw the tree of the vehicles."""
    families = study.families
    return figures.family_tree(
        families.merges,
        study.names,
        [families.number(name) for name in study.names],
        families.cut,
    )


def asked(study: CorrelationStudy) -> Section:
    """Say what was evaluated."""
    doe, space = study.doe, study.doe.space
    platform = study.runs.platform
    cases = ", ".join(
        f"{platform.load_case(case.name).title} (weight {weight:g})"
        for case, weight in study.runs.cases
    )
    scatter = study.by_vehicle.scatter
    known = (
        f" {study.n_known} of the asked designs were known already and not evaluated again."
        if study.n_known
        else ""
    )
    lost = (
        f"; {study.n_untoleranced} of them failed in some draw and have no scatter"
        if study.n_untoleranced
        else ""
    )
    return Section(
        "What was asked, and with which data",
        f"{platform.title}: {platform.description}\n\n"
        f"Load cases: {cases}. Lines: {study.index.n_lines} between {study.runs.band[0]:g} and "
        f"{study.runs.band[1]:g} Hz. A vehicle's index is SPLV, the sum of its SPL over the lines, "
        "shown divided by their number.\n\n"
        f"{len(doe)} designs ({study.plan}) of {space.n_variables} stiffness factors between "
        f"{space.lower.min():g} and {space.upper.max():g}; {doe.n_failed} failed.{known} Each was "
        f"also made {scatter.n_draws} times within its tolerance of "
        f"±{100 * space.tolerance.max():.0f} % (three standard deviations){lost}.\n\n"
        "Three correlations are told apart. Designs: the levels of the designs as drawn, the "
        "thesis's. Means: of each design's mean over its scatter. Tolerance scatter: of what "
        "manufacturing adds, each draw less its design's mean, all designs pooled. Intervals are "
        f"95 % bootstrap intervals over the designs ({study.resamples} resamples): they say how "
        "much the coefficients would move with other designs, not with other vehicles.",
    )


def family_section(
    study: CorrelationStudy, tables: Mapping[str, pd.DataFrame], pictures: Mapping[str, bytes]
) -> Section:
    """Say which vehicles can share one mount set."""
    families = study.families
    return Section(
        "Which vehicles can share one mount set?",
        f"{len(families.members)} famil{'y' if len(families.members) == 1 else 'ies'} at "
        f"r = {families.cut:g}: within a family any two vehicles correlate by {families.cut:g} or "
        "more over the designs (hierarchical clustering of 1 − r, complete linkage). What quietens "
        "one vehicle of a family then quietens the others; how much it does is another matter and "
        "shows in σ over designs. A vehicle alone in its family needs its own look before it gets "
        "the mounts of the others.",
        figures=(
            picture(
                pictures,
                "families",
                "Vehicles by family. Branches join where the worst pair below them stands; those "
                "left of the dashed line are families.",
            ),
        ),
        tables=(
            Table(tables["families"], "Families and their worst pairs, in all three correlations."),
            Table(
                tables["vehicles"],
                "By vehicle. A dash: alone in its family.",
                {"sigma over designs [dB]": 3, "sigma over the tolerance [dB]": 3},
            ),
        ),
    )


def fleet_section(
    tables: Mapping[str, pd.DataFrame], pictures: Mapping[str, bytes]
) -> tuple[Section, ...]:
    """Say how often fleets that nobody chose show the same; nothing for other platforms."""
    if "rates" not in tables:
        return ()
    n = int(tables["rates"]["fleets"].iloc[0])
    return (
        Section(
            "How special is this fleet?",
            "The virtual platform's fleet was selected because it shows every phenomenon of the "
            f"thesis. {n} fleets were drawn from the same prior and none of them selected, with "
            "the true forces of 5th gear at 220 Nm; the rates say how often a phenomenon comes by "
            "itself. A rate near 1 follows from the physics of the model, a small one is the "
            "choice of this fleet.",
            figures=(
                picture(
                    pictures,
                    "unselected_fleets",
                    "Correlations in the unselected fleets (grey), those of this platform (orange) "
                    "and the bounds asked for (dashed).",
                ),
            ),
            tables=(Table(tables["rates"], "Phenomena beside their rates."),),
        ),
    )


def pair_words(pairs: pd.DataFrame) -> Table:
    """Return the pairs for the page: designs with their interval, the others beside them."""
    kinds = {kind: part.reset_index() for kind, part in pairs.groupby("correlated", sort=False)}
    designs, means, scatter = kinds.values()
    frame = pd.DataFrame(
        {
            "pair": designs["first"] + " and " + designs["second"],
            "r [1]": designs["pearson [1]"],
            "from [1]": designs["pearson from [1]"],
            "to [1]": designs["pearson to [1]"],
            "Spearman [1]": designs["spearman [1]"],
            "r, means [1]": means["pearson [1]"],
            "r, tolerance [1]": scatter["pearson [1]"],
        }
    )
    return Table(frame, "Pairs: Pearson's r over the designs with its interval, and the others.")


def picture(pictures: Mapping[str, bytes], stem: str, caption: str) -> Picture:
    """Return a figure with its words."""
    return Picture(pictures[stem], alt=caption, caption=caption)
