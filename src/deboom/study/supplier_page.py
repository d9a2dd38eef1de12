"""The page for a mount supplier who has never met us."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from deboom.measurement.propagated_interval import Interval
from deboom.report.page import Headline, Page, Picture, Section, Table
from deboom.report.style import signed
from deboom.study.motion import Factor
from deboom.study.motion_report import factor_name
from deboom.study.robust_front import NOTICEABLE
from deboom.study.specification_page import specification_section
from deboom.study.supplier_certainty import MEASURED_AGAIN
from deboom.study.supplier_effects import ALL, PICKED
from deboom.study.supplier_figures import SupplierContent
from deboom.study.supplier_study import DRAWS, Need
from deboom.study.supplier_tables import one_part_table

TERMS = (
    "booming noise",
    "SPL",
    "dynamic stiffness",
    "loss factor",
    "preload",
    "stiffness factor",
    "tolerance",
    "σ",
    "no requirement",
    "not identified",
    "no noticeable difference",
    "sensitivity index",
)
CURVE_SCALED = "the whole curve over static force is to be scaled alike, with the stops re-tuned"
PART_SCALED = (
    "the rubber itself is to be scaled, its force at every deflection. The numbers are those at "
    "today's static deflection; under load the part rides elsewhere, as the curves show"
)
OPERATION = (
    "Dots are the states in the load cases and scatter because amplitude and frequency differ"
)
AS_ON_A_MACHINE = (
    "; the curves are read at one frequency and amplitude (in the table below), as on a test "
    "machine, where measurements back them"
)
NO_UNCERTAINTY = (
    "Today's stiffnesses come from operating spectra without a characterisation of the mounts: "
    "their intervals rest on usual tolerances of a measuring chain, which nobody has stated."
)
REQUIREMENT = (
    "direction",
    "requirement",
    "today [N/mm]",
    "± 90 % [%]",
    "wanted [N/mm]",
    "at least [N/mm]",
    "at most [N/mm]",
    "free from [N/mm]",
    "free to [N/mm]",
)
LOSS_FACTORS = (
    "direction",
    "loss factor today [1]",
    "loss factor ± 90 % [1]",
    "loss factor wanted [1]",
)
WORTH = (
    "direction",
    "tolerance today ± [%]",
    "share of sigma [%]",
    "share of sigma ± 90 % [%]",
    "sigma saved per % tighter [0.001 dB]",
    "sigma saved ± 90 % [0.001 dB]",
    "largest share [%]",
    "in",
)
EDGE = 0.02
"""Of the range of the search that counts as its edge [1]."""
_WHOLE = {name: 0 for name in REQUIREMENT if name.endswith("[N/mm]")}


def supplier_page(
    content: SupplierContent, pictures: Mapping[str, bytes], provenance: Mapping[str, object]
) -> Page:
    """Compose the page from its tables and pictures."""
    study, tables = content.study, content.tables
    what = "the mounts" if content.mount is None else f"mount {content.mount}"
    low, high = study.band
    unknown = () if study.parts else (NO_UNCERTAINTY,)
    return Page(
        title=f"What {what} should be",
        question=(
            f"Which dynamic stiffness of {what} keeps {_count(content.vehicles)} quiet "
            f"between {low:g} and {high:g} Hz, how exactly must it be made, and what does it bring?"
        ),
        headlines=_headlines(content),
        terms=tuple(content.motion.terms.get(term, term) for term in TERMS),
        warnings=(*unknown, *content.motion.warnings),
        sections=(
            _wanted(content, pictures),
            specification_section(content.sheet, content.tables),
            _parts(content, pictures),
            _importance(content, pictures),
            _tolerances(content, pictures),
            _certainty(content),
            Section(
                "Data sheet",
                "Units are SI with mm for lengths and N/mm for stiffness; every table of this page "
                "and the points of the curves are in the workbook beside it.",
                tables=(Table(tables["data sheet"], "What the numbers stand for."),),
            ),
        ),
        provenance=provenance,
    )


def _headlines(content: SupplierContent) -> tuple[Headline, ...]:
    effects, requirement = content.effects, content.tables["requirements"]
    asked = requirement[requirement["requirement"] == Need.wanted.value]
    if content.mount is None:
        first = Headline(
            f"{len(asked)} of {len(requirement)}", "directions have a stiffness that must be met"
        )
        name = min(content.mounts, key=lambda mount: float(effects.change[mount].mean()))
    else:
        name = content.mount
        away = (asked["wanted / today [1]"] - 1.0).abs()
        if asked.empty:
            first = Headline("none", f"direction of {name} must change")
        else:
            row = asked.iloc[int(np.argmax(away))]
            first = Headline(
                f"{row['today [N/mm]']:.0f} → {row['wanted [N/mm]']:.0f} N/mm",
                f"{row['direction']}, the largest change",
            )
    sure = effects.certainty
    worth = content.tables["tolerances"]
    top = worth.iloc[int(np.argmax(worth["share of sigma [%]"]))]
    return (
        first,
        Headline(_with_half_width(sure.mean_change(name)), f"mean level, only {name} changes"),
        Headline(_with_half_width(sure.mean_change(ALL)), "mean level, all parts as wanted"),
        Headline(
            f"{top['share of sigma [%]']:.0f} ± {top['share of sigma ± 90 % [%]']:.0f} %",
            f"of the scatter comes from {top['direction']}",
        ),
    )


def _wanted(content: SupplierContent, pictures: Mapping[str, bytes]) -> Section:
    study, table = content.study, content.tables["requirements"]
    case, _ = study.load_cases[0]
    part = factor_name(study.motion_index) == Factor.part.value
    scaled = PART_SCALED if part else CURVE_SCALED
    given_up = ""
    if study.unidentified:
        values, scale = content.effects.values, study.per_vehicle / len(study.vehicles)
        lost = (values.mean_sum[-2] - values.mean_sum[-1]) * scale
        half = float(content.effects.certainty.mean_difference(ALL, PICKED).half_width)
        own = [one.name for one in content.directions if one.need is Need.unknown]
        given_up = (
            f"\n\nNot identified: {', '.join(own) or 'directions of other mounts'}. No number is "
            "asked for there. The search had moved such directions as well; leaving all of them as "
            f"they are changes the mean level by {signed(float(lost), 2)} ± {half:.2f} dB."
        )
    return Section(
        "What is wanted",
        "A stiffness is the mean magnitude of the dynamic stiffness over the lines of the run "
        f"“{case.title}”; {scaled}. At least and at "
        "most: the tolerance band. Free: the range in which the mean level of all vehicles stays "
        f"within {NOTICEABLE} dB, all other directions kept. A dash: nothing is asked."
        f"{_at_bounds(content)}{given_up}",
        figures=tuple(
            _picture(
                pictures,
                f"stiffness {mount}",
                f"{mount}: dynamic stiffness over preload. {OPERATION}"
                f"{AS_ON_A_MACHINE if any(c.has_curve for c in content.curves) else ''}.",
            )
            for mount in content.mounts
            if f"stiffness {mount}" in pictures
        ),
        tables=(
            Table(table[list(REQUIREMENT)], "Today's and the wanted stiffness.", _WHOLE),
            Table(
                table[list(LOSS_FACTORS)],
                "Loss factors, mean over the same lines; what is asked for is the wanted one.",
            ),
            Table(
                content.tables["conditions"],
                "Preloads in the load cases, and the test condition of each curve.",
                {"least preload": 0, "greatest preload": 0},
            ),
        ),
    )


def _at_bounds(content: SupplierContent) -> str:
    """Name the wanted directions at the edge of what was searched."""
    study = content.study
    named = [
        f"{one.name} ({study.wanted[one.column]:.2f} of today's)"
        for one in content.directions
        if one.need is Need.wanted
        and min(
            study.wanted[one.column] - study.space.lower[one.column],
            study.space.upper[one.column] - study.wanted[one.column],
        )
        <= EDGE * (study.space.upper[one.column] - study.space.lower[one.column])
    ]
    if not named:
        return ""
    return (
        f"\n\nAt the edge of what was searched: {', '.join(named)}. Going further may bring more; "
        "tell us what can be made."
    )


def _parts(content: SupplierContent, pictures: Mapping[str, bytes]) -> Section:
    alone = "parts change one at a time" if content.mount is None else "only this part changes"
    drawn = [
        _picture(
            pictures,
            "parts",
            "Change against today's mounts without scatter, mean over the lines. Whiskers: half "
            "width of the 90 % interval by all errors of measurement.",
        )
    ]
    if "levels" in pictures:
        case, _ = content.study.load_cases[0]
        drawn.append(
            _picture(
                pictures,
                "levels",
                f"Sound pressure level at the driver's ear today (baseline) and with only "
                f"{content.mount} as wanted (optimised); {case.title}.",
            )
        )
    if content.mount is None:
        summary = content.tables["part alone, summary"]
        by_scatter = [n for n in map(str, summary) if n == "changed" or "sigma" in n]
        tables = (
            Table(
                summary.drop(columns=by_scatter[1:]),
                "Mean over the vehicles, and the vehicles with most and least effect.",
            ),
            Table(summary[by_scatter], "Scatter σ of all vehicles together."),
        )
    else:
        table = one_part_table(content.tables["part alone"], content.mount)
        by_peak = ["vehicle", *(name for name in map(str, table) if "peak" in name)]
        tables = (
            Table(
                table.drop(columns=by_peak[1:]),
                "Change of the mean level per vehicle, and the scatter σ of that level.",
            ),
            Table(table[by_peak], "Level of the loudest booming peak."),
        )
    return Section(
        f"What happens if {alone}",
        "One mount is as wanted in all its directions, the others are as they are today; diamonds "
        "show what all mounts bring together. The effects of parts do not simply add: forces "
        "through different mounts may cancel each other at the ear.",
        figures=tuple(drawn),
        tables=tables,
    )


def _importance(content: SupplierContent, pictures: Mapping[str, bytes]) -> Section:
    found, space = content.effects.importance, content.study.space
    low, high = space.lower.min(), space.upper.max()
    leading = []
    for place, vehicle in enumerate(content.vehicles):
        top = int(np.argmax(found.total[:, place]))
        if top in [direction.column for direction in content.directions]:
            leading.append(
                f"{found.factors[top]} in {vehicle} ({found.total[top, place]:.2f} ± "
                f"{found.total_interval[top, place]:.2f}, leading in "
                f"{100.0 * content.effects.certainty.leads[place]:.0f} % of what is drawn again)"
            )
    sentence = f" The leading direction: {', '.join(leading)}." if leading else ""
    return Section(
        "Which directions matter in which vehicle",
        f"All factors of all mounts vary at the same time, evenly between {low:g} and {high:g}; "
        "shown is the share of each direction in the variance of the mean level, with its 95 % "
        f"interval from {found.n_resamples} resamples of {found.n_base} points.{sentence}",
        figures=(
            _picture(
                pictures,
                "importance",
                "Total Sobol index per vehicle: filled what the direction does alone, hatched what "
                "it does together with others.",
            ),
        ),
    )


def _tolerances(content: SupplierContent, pictures: Mapping[str, bytes]) -> Section:
    shares = content.effects.shares
    rest = max(math.ceil(100.0 * float(shares.rest.max())), 1)
    return Section(
        "Where the scatter comes from, and what a tighter tolerance is worth",
        "Parts that are all within their tolerance make vehicles of one type differ by σ. The "
        "share of a direction in it says where a tighter tolerance pays; the other column says how "
        "much σ falls for each percentage point, such as ±14 % instead of ±15 %, mean over the "
        f"vehicles, of {DRAWS} draws around the wanted design. At most {rest} % of σ² in a "
        "vehicle belong to no single direction.",
        figures=(
            _picture(
                pictures,
                "tolerances",
                "Share of each direction in the scatter, and σ saved by one percentage point.",
            ),
        ),
        tables=(
            Table(
                content.tables["tolerances"][list(WORTH)],
                "Shares are of σ²; the largest one and its vehicle beside the mean.",
                {
                    "tolerance today ± [%]": 0,
                    "sigma saved per % tighter [0.001 dB]": 1,
                    "sigma saved ± 90 % [0.001 dB]": 1,
                },
            ),
        ),
    )


def _certainty(content: SupplierContent) -> Section:
    study = content.study
    text = (
        "The error budget of the characterisation covers sensors, shaker, force cells and noise; "
        "its 95 % half width is that of the stiffness itself. Above 15 % a direction counts as not "
        "identified and no number is asked for. R² says how well the response surface repeats what "
        "was measured; it is no accuracy."
    )
    again = (
        "Numbers with ± 90 %, or from … to, have an interval: all measurements are drawn again "
        f"{MEASURED_AGAIN} times with the errors below, the same for all designs and vehicles, and "
        "computed anew; in 90 % of such cases the truth lies inside. The relative half width of "
        "today's stiffness belongs to every stiffness of its row. The model of the motion has "
        "errors of its own, which are not in them."
    )
    texts = (text if study.parts else NO_UNCERTAINTY, again, content.motion.text)
    return Section(
        "How sure we are",
        "\n\n".join(filter(None, texts)),
        tables=(
            Table(content.tables["quality"], "Today's stiffness, direction by direction."),
            Table(content.tables["errors"], "Errors of measurement behind the intervals."),
        ),
    )


def _with_half_width(change: Interval) -> str:
    return f"{signed(float(change.value), 1)} ± {float(change.half_width):.1f} dB"


def _picture(pictures: Mapping[str, bytes], stem: str, caption: str) -> Picture:
    return Picture(pictures[stem], alt=caption, caption=caption)


def _count(vehicles: tuple[str, ...]) -> str:
    return vehicles[0] if len(vehicles) == 1 else f"{len(vehicles)} vehicles"
