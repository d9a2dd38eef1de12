"""A validated synthesis as the result of a study."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pandas as pd
from threadpoolctl import threadpool_limits

from deboom.arrays import RealArray
from deboom.errors import InputError
from deboom.study.modal_figures import modal_figures
from deboom.study.modal_part import ModalPart, modal_part, modal_tables
from deboom.study.modal_part import summary as modal_summary
from deboom.study.result import Scalar, StudyResult
from deboom.study.synthesis_validation import Listening
from deboom.study.synthesis_validation_criteria import (
    ModesAgainstTruth,
    criteria,
    criteria_table,
    headline_numbers,
)
from deboom.study.synthesis_validation_data import ValidationData
from deboom.study.synthesis_validation_figures import validation_figures
from deboom.study.synthesis_validation_numbers import (
    Validation,
    cause_table,
    comparison_table,
    force_table,
    peak_table,
    validate,
)
from deboom.study.synthesis_validation_page import validation_page
from deboom.vehicles.path_analysis import Measure


def synthesis_validation_result(
    data: ValidationData,
    ear: str,
    band: tuple[float, float],
    *,
    with_figures: bool = True,
) -> StudyResult:
    """Compare, and make tables, figures, headline numbers and page.

    Parameters
    ----------
    data : ValidationData
        Bench and vehicles.
    ear : str
        To listen at.
    band : (lower, upper)
        Lines that are compared; both edges belong to the band [Hz].
    with_figures : bool
        Whether to draw.

    Returns
    -------
    StudyResult
        Table ``validation`` with every figure beside the thesis and the target; ``comparisons``,
        ``peaks``, ``causes``, ``forces``, ``contributions`` and those of the modal analysis.

    Raises
    ------
    InputError
        Data that do not fit together, an ear that was not measured.
    """
    with threadpool_limits(1):  # its matrices are too small to share
        result = validate(data, Listening(ear, band))
        part, complaint = _modes(result)
        truth = _true_shapes(result, part)
        modes: dict[str, Scalar] = {} if part is None else dict(modal_summary(part, truth))
        comparisons, causes, forces = (
            table(result) for table in (comparison_table, cause_table, force_table)
        )
        against = _against_truth(result, part)
        found = criteria(result, comparisons, causes, forces, modes, against)
        tables = {
            "validation": criteria_table(found),
            "comparisons": comparisons,
            "peaks": peak_table(result),
            "contributions": _ranking(result),
        }
        if len(causes):
            tables |= {"causes": causes, "forces": forces}
        if part is not None:
            tables |= modal_tables(part, truth)
        figures: dict[str, bytes] = {}
        if with_figures:
            figures = validation_figures(result, comparisons, causes)
            if part is not None:
                figures |= modal_figures(part, truth)
    return StudyResult(
        tables=tables,
        figures=figures,
        summary=headline_numbers(result, comparisons, modes),
        page=validation_page(result, found, tables, figures, complaint),
        inputs=data.input_files,
        facts=_facts(result, complaint),
    )


def _modes(result: Validation) -> tuple[ModalPart | None, str]:
    """Modes of the first vehicle's body, or why there are none."""
    try:
        return modal_part(result.shown[0].driven.vehicle), ""
    except InputError as error:
        return None, str(error)


def _true_shapes(result: Validation, part: ModalPart | None) -> RealArray | None:
    truth = result.shown[0].driven.truth
    if part is None or truth is None:
        return None
    return truth.mode_shapes(len(part.model.outputs))


def _against_truth(result: Validation, part: ModalPart | None) -> ModesAgainstTruth | None:
    """Give every mode that was found the nearest true one, and see which of these are left."""
    truth = result.shown[0].driven.truth
    if part is None or truth is None:
        return None
    found = part.model.frequency[: part.n_modes]
    true = truth.natural_frequency
    nearest = np.abs(np.subtract.outer(found, true)).argmin(axis=1)
    damping = part.model.damping[: part.n_modes] / truth.damping_ratio[nearest]
    return ModesAgainstTruth(
        frequency=float(np.max(np.abs(found / true[nearest] - 1))),
        damping=float(np.max(np.abs(damping - 1))),
        missed=len(set(range(part.n_modes)) - set(nearest.tolist())),
    )


def _ranking(result: Validation) -> pd.DataFrame:
    """Paths of the first vehicle in order of what they bring."""
    ranking = result.shown[0].reciprocal.ranking(Measure.MAGNITUDE, result.listening.band)
    return pd.DataFrame(
        {
            "path": [one.path for one in ranking.paths],
            "rms contribution [Pa]": [one.magnitude for one in ranking.paths],
            "share of the energy [%]": [100 * one.energy_share for one in ranking.paths],
        }
    )


def _facts(result: Validation, complaint: str) -> dict[str, Scalar]:
    data = result.data
    facts: dict[str, Scalar] = {
        "run": data.run,
        "ear": result.listening.ear,
        "vehicles": _words([one.vehicle.name for one in data.vehicles]),
        "mount_sets": _words([name for name in data.sets if name not in data.mixes]),
        "held_out": "surfaces are fitted to all runs but the one that is looked at",
        "transfer_functions": "reciprocal",
    }
    if result.design is not None:
        design = result.design
        facts |= {
            "virtual_design": design.mix,
            "virtual_design_other_set": design.other,
            "virtual_design_sweeps": design.resolved.sweeps,
            "virtual_design_lines_outside": int(design.resolved.outside.sum()),
        }
    if complaint:
        facts["no_modal_analysis"] = complaint
    return facts


def _words(names: Sequence[str]) -> str:
    return ", ".join(names)
