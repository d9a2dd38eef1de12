"""A platform study as one result: files and headline numbers of its parts, and one page."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import TypeVar

from deboom.study.group_correlation_result import group_correlation_result
from deboom.study.platform_study import PlatformStudy
from deboom.study.platform_study_page import platform_page
from deboom.study.result import Scalar, StudyResult
from deboom.study.robust_front_result import robust_front_result
from deboom.study.sensitivity_result import sensitivity_result
from deboom.study.vehicle_correlation_result import vehicle_correlation_result

_T = TypeVar("_T")
SAME_DOE = ("doe", "n_designs", "n_failed", "n_unselected_fleets")
"""What the vehicles of a group would say of the DOE once more."""


def platform_result(study: PlatformStudy) -> StudyResult:
    """Make tables, figures, headline numbers and page of a platform study.

    Parameters
    ----------
    study : PlatformStudy
        Done.

    Returns
    -------
    StudyResult
        Everything that `robust_front_result`, `group_correlation_result`,
        `vehicle_correlation_result` and `sensitivity_result` return, under their names. Of a name
        that an earlier one of them has, the later gets a prefix: ``doe_``, ``within_group_`` or
        ``sobol_``.
    """
    fleet, vehicles = study.fleet, study.vehicles
    by_group = None if fleet is None else group_correlation_result(fleet)
    by_vehicle = (
        None if vehicles is None else _without_doe(vehicle_correlation_result(vehicles, None))
    )
    front = robust_front_result(study.front)
    ranked = sensitivity_result(study.sensitivity)
    by_prefix = {"": front, "doe_": by_group, "within_group_": by_vehicle, "sobol_": ranked}
    parts = {prefix: part for prefix, part in by_prefix.items() if part is not None}
    inputs = dict.fromkeys(path for part in parts.values() for path in part.inputs)
    facts: dict[str, Scalar] = {}
    for part in parts.values():
        facts = {**part.facts, **facts}
    return StudyResult(
        tables=_joined({prefix: part.tables for prefix, part in parts.items()}),
        figures=_joined({prefix: part.figures for prefix, part in parts.items()}),
        summary=_joined({prefix: part.summary for prefix, part in parts.items()}),
        page=platform_page(study, by_group, by_vehicle, front, ranked),
        inputs=tuple(inputs),
        facts=facts,
    )


def _without_doe(result: StudyResult) -> StudyResult:
    """Leave out what the correlation of groups says of the same DOE."""
    return replace(result, tables=_new(result.tables), summary=_new(result.summary))


def _new(part: Mapping[str, _T]) -> dict[str, _T]:
    return {name: value for name, value in part.items() if name not in SAME_DOE}


def _joined(parts: Mapping[str, Mapping[str, _T]]) -> dict[str, _T]:
    """Put parts into one mapping; a name that is taken gets the prefix of its part."""
    joined: dict[str, _T] = {}
    for prefix, part in parts.items():
        joined |= {prefix + name if name in joined else name: part[name] for name in part}
    return joined
