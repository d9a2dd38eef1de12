"""The front of a wide fleet and its report: processor seconds of search, tables and pictures.

The shipped platform with its fifteen vehicles repeated, each path's transfer function turned and
scaled at random, 100 designs over 50 generations, coupled. ``python benchmarks/wide_fleet.py 200``.
"""

from __future__ import annotations

import re
import shutil
import sys
import tempfile
import time
from dataclasses import replace
from pathlib import Path

import numpy as np

from deboom.files.uff import read_uff, write_uff
from deboom.report import Report
from deboom.runs.runner import load_study, run_study

SHIPPED = Path(__file__).parents[1] / "studies" / "data" / "u06_f39_f45"
SPREAD = 0.2
"""Standard deviation of the real and imaginary part of a path's factor [1]."""
_VEHICLES = re.compile(r"(?s)\[\[vehicles\]\].*?(?=\[\[load_cases\]\])")


def write_wide_fleet(folder: Path, count: int, seed: int = 1) -> Path:
    """Write the shipped platform with `count` vehicles into a new folder, and return it."""
    shutil.copytree(SHIPPED, folder, ignore=shutil.ignore_patterns("truth", "noise_transfer"))
    (folder / "noise_transfer").mkdir()
    generator = np.random.default_rng(seed)
    measured = [read_uff(path) for path in sorted((SHIPPED / "noise_transfer").glob("*.uff"))]
    entries = []
    for number in range(1, count + 1):
        name, node = f"V-{number:03d}", 900 + number
        functions = [
            replace(
                function,
                response_node=node,
                id_lines=(f"noise transfer function, {name}",),
                values=function.values * (1.0 + SPREAD * generator.normal(size=2) @ (1.0, 1.0j)),
            )
            for function in measured[(number - 1) % len(measured)]
        ]
        write_uff(folder / f"noise_transfer/{name}.uff", functions)
        entries.append(
            f'[[vehicles]]\nname = "{name}"\ngroup = "wide"\n'
            f'noise_transfer = "noise_transfer/{name}.uff"\near_node = {node}\n'
        )
    text = (folder / "platform.toml").read_text(encoding="utf-8")
    text = _VEHICLES.sub("\n".join(entries) + "\n", text)
    (folder / "platform.toml").write_text(text, encoding="utf-8")
    return folder


def main(count: int) -> None:
    """Run the front study of a wide fleet and print where its processor seconds go."""
    drawn = []
    figures = Report.figures.fget

    def timed(report: Report) -> dict[str, bytes]:
        begin = time.process_time()
        drawings = figures(report)
        drawn.append(time.process_time() - begin)
        return drawings

    Report.figures = property(timed)
    with tempfile.TemporaryDirectory() as name:
        platform = write_wide_fleet(Path(name) / "platform", count)
        study = load_study("front")
        wall, begin = time.perf_counter(), time.process_time()
        options = {"platform": platform, "group": ["wide"], "population": 100, "generations": 50}
        options |= {"with_": "prescribed"}
        folder = run_study(study, Path(name) / "results", options)
        whole = time.process_time() - begin
        print(
            f"{count} vehicles: {whole:.0f} s of processor time, {sum(drawn):.0f} s of it "
            f"pictures; {time.perf_counter() - wall:.0f} s by the clock"
        )
        for path in sorted(folder.rglob("*"), key=lambda path: -path.stat().st_size)[:8]:
            print(f"{path.stat().st_size / 1e6:8.1f} MB  {path.relative_to(folder)}")


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 200)
