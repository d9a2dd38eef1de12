"""Deboom's own studies: where they are, names that they had, and what they imported then.

Versions before 0.5 take the names of version 0.3.
"""

from __future__ import annotations

import ast
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from deboom.errors import InputError


def shipped_studies() -> Path:
    """Return the folder of deboom's own studies: in the package, in a clone beside ``src``."""
    package = Path(__file__).parents[1]
    inside = package / "studies"
    return inside if inside.is_dir() else package.parents[1] / "studies"


@dataclass(frozen=True)
class FormerStudy:
    """A study of version 0.3, as a study of today.

    - `today`: its name.
    - `defaults`: options whose default was another one, by name.
    - `gone`: options that it took and today's does not, with the values that change no model, and
      what there is in their place.
    """

    today: str
    defaults: Mapping[str, Any] = field(default_factory=dict)
    gone: Mapping[str, tuple[tuple[Any, ...], str]] = field(default_factory=dict)

    def arguments(self, given: Mapping[str, Any]) -> dict[str, Any]:
        """Return options of the former study as today's takes them.

        - `given`: options by name.
        - raises InputError: an option that is gone and changed the model.
        """
        for name in given.keys() & self.gone.keys():
            ignored, instead = self.gone[name]
            if given[name] not in ignored:
                raise InputError(f"{self.today} has no --{name.replace('_', '-')}: {instead}")
        kept = {name: value for name, value in given.items() if name not in self.gone}
        return {**self.defaults, **kept}


FORMER_STUDIES = {
    "u06_platform": FormerStudy("front"),
    "u06_robust_front": FormerStudy(
        "front",
        {"with_": "prescribed", "generations": 50},
        {
            # a record has the options that it stood for as well
            "as_thesis": (
                (False, True),
                "write --motion prescribed --sampler fresh --samples 100",
            ),
            "free_tolerances": (
                (False,),
                "`deboom run tolerance_allocation --free-tolerances` has them as variables",
            ),
        },
    ),
    "u06_sensitivity": FormerStudy("sensitivity"),
    "fleet_correlation": FormerStudy("correlation"),
    "compressor_robust_front": FormerStudy("compressor_front"),
    "compressor_identification": FormerStudy("identify"),
    "compressor_unbalance": FormerStudy("unbalance"),
}

MOVED = {
    "second_engine": "this study is an example now, examples/mounts/plot_second_engine.py: "
    "deboom.mounts.surface_forces.predicted_forces predicts the forces"
}
"""Studies of version 0.3 that are none any more, and where they are."""


MOVED_NAMES: Mapping[str, Mapping[str, str]] = {
    "deboom.bench.truth": {
        "SetTruth": "deboom.mounts.characterised_bench.SetTruth",
        "read_set_truth": "deboom.files.truth.read_set_truth",
    },
    "deboom.choices": {
        "CalibrationLevel": "deboom.bench.choices.CalibrationLevel",
        "CompressorCase": "deboom.bench.choices.CompressorCase",
        "Pick": "deboom.explore.choices.Pick",
        "SofteningLaw": "deboom.compressor.unbalance.SofteningLaw",
        "pick_or_file": "deboom.explore.choices.pick_or_file",
    },
    "deboom.common": {
        "AXES": "deboom.arrays.AXES",
        "N_PER_MM": "deboom.physics.dynamic_stiffness.N_PER_MM",
        "PERCENT": "deboom.arrays.PERCENT",
        "Progress": "deboom.progress.Progress",
        "listed": "deboom.errors.listed",
    },
    "deboom.compressor.identification": {
        "IdentifyOptions": "deboom.compressor.identified_compressor.IdentifyOptions",
    },
    "deboom.compressor.virtual_point_fit": {
        "THESIS_BANDS": "deboom.compressor.inertance_fit.THESIS_BANDS",
    },
    "deboom.explore.robust": {
        "DesignLimits": "deboom.explore.robust.Limits",
    },
    "deboom.files.front_run": {
        "SupplierStudy": "deboom.pages.supplier_study.SupplierStudy",
    },
    "deboom.files.limits": {
        "mount_limits": "deboom.files.design_limits.read_mount_limits",
    },
    "deboom.pages.compressor_identification": {
        "Beside": "deboom.runs.compressor_tests.Beside",
        "CompressorTruth": "deboom.compressor.identification_results.CompressorTruth",
        "STEPS": "deboom.runs.compressor_tests.IDENTIFICATION_STEPS",
        "identified_test": "deboom.runs.compressor_tests.identified_test",
        "identified_virtual": "deboom.runs.compressor_tests.identified_virtual",
        "in_words": "deboom.report.tables.in_words",
        "read_test": "deboom.runs.compressor_tests.read_test",
    },
    "deboom.pages.compressor_noise": {
        "FLOOR": "deboom.runs.compressor_tests.FLOOR",
        "NoisePlan": "deboom.runs.compressor_tests.NoisePlan",
        "STEPS": "deboom.runs.compressor_tests.NOISE_STEPS",
        "band_level": "deboom.compressor.noise_comparison.band_level",
        "car_whose_hoses_add": "deboom.runs.compressor_tests.car_whose_hoses_add",
        "noise_of_car": "deboom.runs.compressor_tests.noise_of_car",
        "soft_partner": "deboom.compressor.noise_comparison.soft_partner",
        "virtual_car": "deboom.runs.compressor_tests.virtual_car",
    },
    "deboom.pages.compressor_unbalance": {
        "STEPS": "deboom.runs.compressor_tests.UNBALANCE_STEPS",
        "UnbalancePlan": "deboom.runs.compressor_tests.UnbalancePlan",
        "measured_unbalance": "deboom.runs.compressor_tests.measured_unbalance",
    },
    "deboom.pages.front_answer": {
        "run_up_sounds": "deboom.pages.front_answer.report_loudest",
    },
    "deboom.pages.mount_characterisation": {
        "characterise_given": "deboom.runs.campaigns.characterise_given",
        "characterise_virtual": "deboom.runs.campaigns.characterise_virtual",
        "identified": "deboom.mounts.characterised_bench.identified",
        "model_table": "deboom.mounts.characterised_bench.model_table",
    },
    "deboom.runs.catalogue": {
        "Catalogue": "deboom.vehicles.catalogue.Catalogue",
        "catalogue_index": "deboom.vehicles.catalogue.catalogue_index",
        "ordered_stiffness": "deboom.vehicles.catalogue.ordered_stiffness",
        "platform_catalogue": "deboom.files.catalogue.platform_catalogue",
    },
    "deboom.runs.compressor_fleet": {
        "MountedFleet": "deboom.compressor.mounted_fleet.MountedFleet",
        "exact_change": "deboom.compressor.mounted_fleet.exact_change",
        "mount_space": "deboom.compressor.mounted_fleet.mount_space",
        "mounted_fleet": "deboom.compressor.mounted_fleet.mounted_fleet",
        "travel_limit": "deboom.compressor.mounted_fleet.travel_limit",
    },
    "deboom.runs.made_parts": {
        "MadeParts": "deboom.files.made_parts.MadeParts",
        "ScatterOptions": "deboom.runs.options.ScatterOptions",
        "ToleranceTask": "deboom.explore.tolerance_allocation.ToleranceTask",
        "Verified": "deboom.explore.tolerance_allocation.Verified",
        "report_parts": "deboom.pages.front.report_parts",
        "rows_of": "deboom.files.tables.row_of_each",
        "target_limits": "deboom.runs.options.target_limits",
        "tolerance_cost": "deboom.files.made_parts.tolerance_cost",
        "with_draws": "deboom.explore.tolerance_allocation.with_draws",
    },
    "deboom.runs.options": {
        "Aim": "deboom.runs.options.AimOptions",
    },
    "deboom.runs.progress": {
        "counted": "deboom.progress.counted",
        "progress_bar": "deboom.progress.progress_bar",
    },
    "deboom.runs.search": {
        "keeping_peaks": "deboom.runs.search.peak_rise_limits",
        "report_limits": "deboom.pages.limits.report_limits",
    },
    "deboom.vehicles.booming_peaks": {
        "BoomingPeak": "deboom.measurement.booming_peaks.BoomingPeak",
        "PressureComparison": "deboom.measurement.booming_peaks.PressureComparison",
        "TOLERANCE": "deboom.measurement.booming_peaks.TOLERANCE",
        "booming_peaks": "deboom.measurement.booming_peaks.booming_peaks",
    },
}
"""Module that studies of version 0.3 import a name from → name → where it is today."""


def moved_imports(source: str) -> list[str]:
    """Say of each name that a script imports from a former place where it is today.

    - `source`: of the script, Python.
    """
    imports = [node for node in ast.walk(ast.parse(source)) if isinstance(node, ast.ImportFrom)]
    return [
        f"{alias.name} of {node.module} is {homes[alias.name]} now"
        for node in imports
        if (homes := MOVED_NAMES.get(node.module or ""))
        for alias in node.names
        if alias.name in homes
    ]


def names_of(study: str) -> tuple[str, ...]:
    """Return the name of a study today, and then those that it had."""
    today = FORMER_STUDIES[study].today if study in FORMER_STUDIES else study
    return (today, *(name for name, former in FORMER_STUDIES.items() if former.today == today))
