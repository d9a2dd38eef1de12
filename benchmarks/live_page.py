"""The page that computes: its numbers beside deboom's, and its times in Chromium.

The model in the page takes 200 random designs of the shipped and of a foreign platform, with
coupled and with prescribed motion; the table has the largest differences. Then the page itself is
opened with 5 and with 15 vehicles and moved 20 times: curves and band are computing alone, painted
is the time from a move to the next frame with the new curves, and to that with the new band. Asked,
on two quiet cores: curves 5 ms, band of 128 draws 80 ms with 15 vehicles, painted 80 ms.

Without Chromium there are no times.
"""

from __future__ import annotations

import json
import statistics
import sys
import tempfile
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

import deboom
from deboom.explore.robust import Robust
from deboom.pages.live_model import LiveCase, live_model
from deboom.report.interactive import render_interactive
from deboom.vehicles.booming_model import BoomingModel

sys.path += [str(Path(__file__).parents[1] / "tests" / folder) for folder in ("", "studies")]

from foreign_platform_samples import write_foreign_platform
from interactive_front_samples import live_front

from browser_samples import Browser
from javascript import evaluated, script

N_DESIGNS, N_DRAWS = 200, 128
PROGRAM = """
return DESIGNS.map((row) => {
  const x = Float64Array.from(row), band = model.band(x, 0, [1], true);
  const levels = Array.from(model.levels(x, 0, true));
  return { levels, splv: Array.from(band.mean), sigma: Array.from(band.sigma) };
});"""
MOVES = """
(async () => {
  const { data, session, timing } = live, toCurves = [], toBand = [];
  const painted = () => new Promise((done) => requestAnimationFrame(() => setTimeout(done)));
  for (const name in timing) timing[name].length = 0;
  for (let i = 0; i < 20; i++) {
    await painted();
    const started = performance.now();
    live.set(data.lower.map((low, k) => low + (data.upper[k] - low) * ((i * 0.37 + k * 0.61) % 1)));
    await painted();
    toCurves.push(performance.now() - started);
    while (!session.band.fresh) await new Promise((done) => setTimeout(done, 1));
    await painted();
    toBand.push(performance.now() - started);
  }
  window.moved = { ...timing, toCurves, toBand };
})()"""


def report() -> str:
    """Compare and time; return both tables as text."""
    with tempfile.TemporaryDirectory() as folder:
        place = Path(folder)
        foreign = deboom.read_platform(write_foreign_platform(place / "foreign"))
        shipped = deboom.read_platform("u06")
        rows = {
            f"{name}, {motion}": _differences(
                platform.model(vehicles, motion=motion, mounts=source), place
            )
            for name, platform, vehicles, source in (
                ("shipped, 15 vehicles", shipped, None, "library"),
                ("foreign, 2 vehicles", foreign, None, "spectra"),
            )
            for motion in ("coupled", "prescribed")
        }
        differences = pd.DataFrame(rows, ["level [dB]", "mean [dB]", "sigma [dB]"]).T
        text = differences.to_string(float_format="{:.1e}".format)
        groups = {5: ("U06",), 15: ("U06", "F39", "F45")}
        try:
            times = {f"{n} vehicles": _times(vehicles, place) for n, vehicles in groups.items()}
        except pytest.skip.Exception as reason:
            return f"{N_DESIGNS} designs, largest differences\n{text}\n\nno times: {reason}"
    table = pd.DataFrame(times).T.to_string(float_format="{:.1f}".format)
    return f"{N_DESIGNS} designs, largest differences\n{text}\n\nmedian of 20 moves\n{table}"


def _differences(model: BoomingModel, folder: Path) -> tuple[float, float, float]:
    """Return the largest differences of the page from deboom, per line of the band [dB]."""
    robust = Robust(model, model.design_space(), draws=N_DRAWS)
    space, case = robust.space, model.cases[0]
    live = live_model([LiveCase(case, 1.0, "", 1.5)], space, robust.scatter(space.nominal))
    draws = np.random.default_rng(5)
    designs = draws.uniform(space.lower, space.upper, (N_DESIGNS, space.n_variables))
    program = f"""{script("model.js")}
const model = makeModel(unpack({live.words}, {json.dumps(live.numbers)}));
const DESIGNS = {json.dumps(designs.tolist())};{PROGRAM}"""
    said = evaluated(program, folder)
    values = robust(designs)
    wanted = {"levels": model.levels(designs), "splv": values.mean, "sigma": values.sigma}
    largest = [
        float(np.abs(np.array([design[name] for design in said]).reshape(of.shape) - of).max())
        for name, of in wanted.items()
    ]
    return largest[0], largest[1] / model.n_lines, largest[2] / model.n_lines


def _times(vehicles: tuple[str, ...], folder: Path) -> dict[str, float]:
    """Open a page, move it, and return the medians [ms]."""
    path = folder / "live.html"
    path.write_text(render_interactive(live_front(vehicles, N_DRAWS)[0]), encoding="utf-8")
    browser = Browser()
    try:
        browser.open(path, width=1440, height=900)
        browser.wait("live.session.band !== null && live.session.band.fresh")
        browser.value("document.querySelector('#live-groups input[value=all]')?.click()")
        browser.wait("live.session.band !== null && live.session.band.fresh")
        browser.value(f"void {MOVES}")
        browser.wait("window.moved !== undefined")
        moved = browser.value("window.moved")
    finally:
        browser.close()
    names = {
        "curves": "curves [ms]",
        "band": "band [ms]",
        "drawing": "drawing [ms]",
        "toCurves": "curves painted [ms]",
        "toBand": "band painted [ms]",
    }
    size = path.stat().st_size / 1e6
    return {w: statistics.median(moved[n]) for n, w in names.items()} | {"page [MB]": size}


if __name__ == "__main__":
    print(report())
