"""The mount supplier's page.

`deboom report RUN --supplier` on a run of `studies/u06_robust_front.py` with a fifth of its budget
(60 × 40 designs), seed 1. "Only this part" is checked against paths and levels put together by hand
from the platform's files, the worth of a tolerance against shares of σ² and against another step
with other draws.
"""

import re
import tempfile
import time
from dataclasses import replace
from pathlib import Path

import numpy as np

from claims import Claim
from deboom.choices import Pick
from deboom.explore.front import verification_response
from deboom.physics.sound_level import spl
from deboom.study.runner import load_study, run_study
from deboom.study.supplier_numbers import SupplierEffects, with_tolerance
from deboom.study.supplier_page import supplier_report, tolerance_table
from deboom.study.supplier_study import shown_names, supplier_study
from deboom.vehicles.fleet import path_contributions

STUDIES = Path(__file__).parents[2] / "studies"


def claims() -> list[Claim]:
    """Write pages of a small run and compare their numbers."""
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder)
        budget = {"generations": 40, "population": 60}
        run = run_study(load_study(STUDIES / "u06_robust_front.py"), out, budget)
        begin = time.perf_counter()
        page, workbook = supplier_report(
            run, mount=None, anonymous=True, out=out / "page", studies=STUDIES
        )
        seconds = time.perf_counter() - begin
        size = (page.stat().st_size + workbook.stat().st_size) / 1e6
        html = page.read_text(encoding="utf-8")
        outside = re.findall(r"(?:src|href)=\"(?!data:|#)", html)
        study = supplier_study(run, STUDIES, Pick.best_mean)
        effects = SupplierEffects(study)
        alone = _alone(effects)
        by_share, by_step = _tolerances(effects)
    top = int(np.argmax(effects.tolerance_gain))
    return [
        Claim("page and workbook of all mounts [MB]", "≤ 6", f"{size:.2f}", size <= 6.0),
        Claim("references to anything outside", "0", str(len(outside)), not outside),
        Claim("written in, its model built again [s]", "≤ 30", f"{seconds:.1f}", seconds <= 30.0),
        Claim(
            "only this part, four mounts × five vehicles, against paths put together by hand [dB]",
            "≤ 1e-6",
            f"{alone:.1e}",
            alone <= 1e-6,
        ),
        Claim(
            f"σ saved per % at {study.space.names[top]}, against its share of σ² [%]",
            "within ±10",
            f"{by_share[top]:+.1f}",
            bool(abs(by_share[top]) <= 10.0),
        ),
        Claim(
            "the same, against a central difference over ±2 points, 4096 other draws [%]",
            "within ±10",
            f"{by_step[top]:+.1f}",
            bool(abs(by_step[top]) <= 10.0),
        ),
    ]


def _alone(effects: SupplierEffects) -> float:
    """Largest difference of a change from the mean level of the fleet's own paths [dB]."""
    study = effects.study
    (case, _), *_ = study.load_cases
    fleet = study.platform.fleet
    own = replace(fleet, vehicles=tuple(v for v in fleet.vehicles if v.name in study.vehicles))
    paths = path_contributions(own, study.platform.mounts, case, study.band)
    worst = 0.0
    for mount in study.platform.mounts:
        design = np.array(
            [
                study.wanted[column] if name.split(" ")[0] == mount.name else 1.0
                for column, name in enumerate(study.space.names)
            ]
        )
        heard = paths.pressure(np.stack([np.ones(design.size), design]))
        both = spl(heard, paths.frequency, axis=-1).mean(axis=2)
        worst = max(worst, float(np.abs(both[1] - both[0] - effects.change[mount.name]).max()))
    return worst


def _tolerances(effects: SupplierEffects) -> tuple[np.ndarray, np.ndarray]:
    """Difference of the page's gain from two other ways to it, relative [%]."""
    study, page = effects.study, effects.tolerance_gain
    scale = study.per_vehicle / len(study.vehicles)
    table = tolerance_table(effects, study.directions, shown_names(study, anonymous=False))
    sigma = study.check(study.wanted[np.newaxis]).sigma_sum[0] * scale
    shares = table["share of sigma [%]"].to_numpy() / 100.0
    by_share = shares * sigma / study.space.tolerance * 0.01
    other = verification_response(study.model, 4096, seed=study.run.seed + 1)
    by_step = []
    for column, tolerance in enumerate(study.space.tolerance):
        wide, tight = (
            with_tolerance(other, column, tolerance + side)(study.wanted[np.newaxis]).sigma_sum[0]
            for side in (0.02, -0.02)
        )
        by_step.append((wide - tight) * scale / 4.0)
    with np.errstate(divide="ignore", invalid="ignore"):
        return 100 * (page / by_share - 1), 100 * (page / np.array(by_step) - 1)
