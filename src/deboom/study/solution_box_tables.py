"""Tables, headline numbers and the box document of an acceptance box."""

from __future__ import annotations

from typing import Any

import numpy as np
import pandas as pd

from deboom.explore.solution_box_reach import UnreachableLimit
from deboom.files.solution_box import AcceptanceBox, BoxResponse, BoxVariable, box_document
from deboom.study.motion_report import motion_name
from deboom.study.mount_source import MountSource
from deboom.study.platform_hash import platform_sha256
from deboom.study.result import Scalar
from deboom.study.solution_box import BoxStudy

PERCENT = 100.0
N_PER_MM = 1e-3
NAN = float("nan")


def box_table(study: BoxStudy) -> pd.DataFrame:
    """One row per variable: its interval, in factors and N/mm, and what it is compared with."""
    box, plain, other = study.box, study.plain, study.bisection.box
    reference = study.reference_stiffness * N_PER_MM
    free = study.effective
    return pd.DataFrame(
        {
            "variable": list(study.variables),
            "requirement": np.where(free, "interval", "no requirement"),
            "Pareto point [1]": study.point,
            "from [1]": box.lower,
            "to [1]": box.upper,
            "half width [%]": PERCENT * 0.5 * box.width / box.centre,
            "from [N/mm]": np.where(free, box.lower * reference, NAN),
            "to [N/mm]": np.where(free, box.upper * reference, NAN),
            "set by the limit": _set_by_the_limit(study),
            "today [N/mm]": reference,
            "one tolerance from [1]": plain.lower,
            "one tolerance to [1]": plain.upper,
            "bisection from [1]": other.lower,
            "bisection to [1]": other.upper,
            "weight [1]": study.question.weight,
            "lower end: parts that keep the limit [%]": PERCENT * study.faces[0],
            "upper end: parts that keep the limit [%]": PERCENT * study.faces[1],
        }
    )


def compared_table(study: BoxStudy) -> pd.DataFrame:
    """One row per box: its share and its width."""
    rows = []
    for name, box, check in (
        ("largest box", study.box, study.found.verified),
        (
            f"±{PERCENT * study.tolerance:g} % about the Pareto point",
            study.plain,
            study.plain_share,
        ),
        ("bisection about the Pareto point", study.bisection.box, study.bisection_share),
    ):
        half = 0.5 * box.width[study.effective] / box.centre[study.effective]
        rows.append(
            {
                "box": name,
                "share that keeps the limit [%]": PERCENT * check.share,
                "at least, with confidence [%]": PERCENT * check.bound,
                "geometric mean half width [%]": PERCENT * _geometric_mean(half),
                "narrowest half width [%]": PERCENT * float(half.min()),
            }
        )
    return pd.DataFrame(rows)


def vehicle_table(study: BoxStudy) -> pd.DataFrame:
    """One row per vehicle: its limit, its level today and in the box, and how many parts miss."""
    today = study.response(study.space.nominal[np.newaxis])[0]
    levels = study.shown_excess + study.question.limit
    return pd.DataFrame(
        {
            "vehicle": list(study.vehicles),
            "limit [dB(A)]": study.question.limit,
            "today [dB(A)]": today,
            "Pareto point [dB(A)]": study.response(study.point[np.newaxis])[0],
            "in the box, mean [dB(A)]": levels.mean(axis=0),
            "95 % of the parts below [dB(A)]": np.quantile(levels, 0.95, axis=0),
            "parts that miss the limit [%]": PERCENT * study.missed,
        }
    )


def curve_table(study: BoxStudy) -> pd.DataFrame:
    """One row per limit: the largest box there, and what the box of one tolerance keeps."""
    rows = []
    for step, one in study.curve:
        question = study.question.lowered(step)
        row: dict[str, Any] = {
            "limit against the stated one [dB]": -step,
            "limit of the first vehicle [dB(A)]": question.limit[0],
        }
        if isinstance(one, UnreachableLimit):
            rows.append(row | {"box": "none", "binding vehicle": one.binding})
            continue
        half = 0.5 * one.box.width[study.effective] / one.box.centre[study.effective]
        missed = 1.0 - one.verified.by_response
        rows.append(
            row
            | {
                "box": "found",
                "geometric mean half width [%]": PERCENT * _geometric_mean(half),
                "share [%]": PERCENT * one.verified.share,
                "share at least [%]": PERCENT * one.verified.bound,
                "share of one tolerance [%]": PERCENT * study.verified(study.plain, question).share,
                "binding vehicle": study.vehicles[int(np.argmax(missed))],
                **{
                    f"{name} missed by [%]": PERCENT * value
                    for name, value in zip(study.vehicles, missed, strict=True)
                },
            }
        )
    return pd.DataFrame(rows)


def box_summary(study: BoxStudy) -> dict[str, Scalar]:
    """Headline numbers; the study's docstring explains the keys."""
    check = study.found.verified
    return {
        "share_stated": study.question.share,
        "share_verified": check.share,
        "share_bound": check.bound,
        "volume_ratio_pm15": study.over_plain.volume,
        "width_ratio_pm15": study.over_plain.width,
        "volume_ratio_bisection": _or_words(study.over_bisection.volume),
        "width_ratio_bisection": _or_words(study.over_bisection.width),
        "share_pm15": study.plain_share.share,
        "n_axes": study.over_plain.n_variables,
        "n_ends_on_bounds": study.ends_on_bounds,
        "limit_db_first_vehicle": float(study.question.limit[0]),
        "limit_could_be_lowered_db": study.found.room,
        "binding_vehicle": study.binding,
        "n_parts_verified": check.n_parts,
        "seconds": round(study.found.seconds, 3),
    }


def acceptance_box(study: BoxStudy) -> AcceptanceBox:
    """Return the box as the file that deliveries are held against."""
    platform, check = study.runs.platform, study.found.verified
    reference = np.where(study.identified, study.reference_stiffness, np.nan)
    # nobody can measure a direction that is not identified, and where the limit sets no end of its
    # interval, nobody needs to
    limited = study.identified | (study.effective & ~study.on_bounds.all(axis=0))
    groups = dict.fromkeys(vehicle.group for vehicle in study.runs.fleet.vehicles)
    return AcceptanceBox(
        title=f"{platform.title}: acceptance box",
        platform=platform.name,
        platform_sha256=platform_sha256(platform),
        group=", ".join(groups),
        motion=motion_name(study.index).removesuffix("-dependent"),
        mounts=(MountSource.library_inside if study.runs.parts else MountSource.spectra).value,
        load_cases=tuple((case.name, float(weight)) for case, weight in study.runs.cases),
        band=study.band,
        quantity=study.response.quantity,
        unit=study.response.response_unit,
        together=study.question.together,
        variables=tuple(
            BoxVariable(
                name=name,
                lower=float(study.box.lower[k]),
                upper=float(study.box.upper[k]),
                nominal=float(study.point[k]),
                reference_stiffness=float(reference[k]) if np.isfinite(reference[k]) else None,
                condition=study.condition,
                weight=float(study.question.weight[k]),
                required=bool(study.effective[k] and limited[k]),
            )
            for k, name in enumerate(study.variables)
        ),
        responses=tuple(
            BoxResponse(name, float(limit), float(share))
            for name, limit, share in zip(
                study.vehicles, study.question.limit, check.by_response, strict=True
            )
        ),
        share_stated=study.question.share,
        share_verified=check.share,
        share_bound=check.bound,
        confidence=check.confidence,
        n_parts=check.n_parts,
        law=study.question.law.name,
        seed=study.seed,
    )


def box_documents(study: BoxStudy) -> dict[str, dict[str, Any]]:
    """Return what other commands load: ``acceptance_box``."""
    return {"acceptance_box": box_document(acceptance_box(study))}


def _set_by_the_limit(study: BoxStudy) -> list[str]:
    """Name the ends that the limit sets; the others lie on the bounds that were searched."""
    words = []
    for on_bounds, effective in zip(study.on_bounds.T, study.effective, strict=True):
        ends = [end for end, bound in zip(("from", "to"), on_bounds, strict=True) if not bound]
        words.append(" and ".join(ends) if effective and ends else "neither")
    return words


def _or_words(ratio: float) -> float | str:
    """Return a ratio to a box, or words where bisection has found none."""
    return ratio if np.isfinite(ratio) else "no box by bisection"


def _geometric_mean(values: np.ndarray) -> float:
    with np.errstate(divide="ignore"):
        return float(np.exp(np.log(values).mean()))
