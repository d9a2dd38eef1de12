"""Prescribed or coupled motion, and searches end to end.

`studies/prescribed_or_coupled.py` with its default budget and three seeds per motion merged into
one front; the table `end_to_end` of `make bench`.
"""

from __future__ import annotations

import json
import tempfile
from pathlib import Path

import end_to_end
from claims import Claim
from deboom.study.runner import load_study, run_study

STUDY = Path(__file__).parents[2] / "studies" / "prescribed_or_coupled.py"
PLATFORM = STUDY.parent / "data" / "u06_f39_f45"
SEARCHES = 3


def claims() -> list[Claim]:
    return [*_study(), *_end_to_end()]


def _study() -> list[Claim]:
    with tempfile.TemporaryDirectory() as folder:
        run = run_study(load_study(STUDY), Path(folder), {"searches": SEARCHES})
        summary = json.loads((run / "summary.json").read_text())
    r, low, high = (summary[key] for key in ("r_min", "slope_min", "slope_max"))
    prescribed, coupled = (summary[f"benefit_{name}_db"] for name in ("prescribed", "coupled"))
    return [
        Claim(
            "SPLV under prescribed against coupled motion, shipped fleet: smallest correlation",
            "at least 0.97",
            f"{r:.3f} over {summary['n_compared']} vehicles and load cases",
            r >= 0.97,
        ),
        Claim(
            "the same: slope, coupled over prescribed",
            "1.1 to 1.35",
            f"{low:.2f} to {high:.2f}",
            low >= 1.1 and high <= 1.35,
        ),
        Claim(
            "true (coupled) benefit of the optimum of prescribed motion [dB]",
            "within 0.1 of that of the optimum of coupled motion",
            f"{prescribed:.2f} against {coupled:.2f}; prescribed motion promised "
            f"{summary['promised_prescribed_db']:.2f}",
            abs(prescribed - coupled) <= 0.1,
        ),
    ]


def _end_to_end() -> list[Claim]:
    table = end_to_end.measure()
    return [
        Claim(
            f"NSGA-II 100 × 100 end to end, {row}",
            f"at least {least:g} times the element-wise loop in pymoo",
            f"{table.loc[row, 'x loop']:.1f} times ({table.loc[row, 'search [s]']:.1f} s, loop "
            f"extrapolated {table.loc[row, 'loop, extrapolated [s]']:.0f} s)",
            bool(table.loc[row, "x loop"] >= least),
        )
        for row, least in ((end_to_end.PRESCRIBED, 11.0), (end_to_end.COUPLED, 24.0))
    ]
