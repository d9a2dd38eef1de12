"""A made-up front for the interactive page: three mounts, two vehicles, seven uneven lines."""

import json
import re
from dataclasses import replace
from functools import cache

import numpy as np

import deboom
from deboom.explore.robust import Robust
from deboom.files.design_limits import read_level_limits, read_mount_limits
from deboom.pages.live_model import Start, live_page
from deboom.plot import CurvePanel, curve_panels
from deboom.plot.style import as_png
from deboom.report.interactive import Axis, InteractiveFront
from deboom.report.report import Picture
from deboom.runs.search import peak_rise_limits

N, MOUNTS, VEHICLES = 9, ("Front", "Roll stop", "Rear"), ("Wagon", '</script><b>Cabrio, "R"')
LINES = np.array([14.0, 15.1, 15.9, 18.0, 21.5, 30.0, 33.3])
FULL_SCALE = 12.5
PANEL = CurvePanel("", np.arange(1, 4), {"hypervolume": np.array([0.1, 0.2, 0.25])})


@cache
def curve():
    return as_png(
        curve_panels([PANEL], x_label="generation [1]", y_label="hypervolume [1]", columns=1)
    )


def front(n=N, lines=LINES, vehicles=VEHICLES, **changes):
    """Three mounts, two vehicles, seven uneven lines; the first factor rises from 0.7 to 1.3."""
    rng = np.random.default_rng(5)
    factors = rng.uniform(0.7, 1.3, (n, 9))
    factors[:, 0] = np.linspace(0.7, 1.3, n)
    names = [f"{mount} {axis}" for mount in MOUNTS for axis in "xyz"]
    axes = [
        Axis(name, "1", factors[:, k], 1.0, "#332288", "variable", (0.7, 1.3), 100.0 * (k + 1))
        for k, name in enumerate(names)
    ]
    axes[1] = replace(axes[1], stiffness=float("nan"), note="no requirement")
    axes += [
        Axis("mean level", "dB(A)", 50.0 + np.arange(n), 60.0, "#0B4F7D", "objective"),
        Axis("σ", "dB", 1.0 - 0.05 * np.arange(n), 1.2, "#0B4F7D", "objective"),
    ]
    axes += [
        Axis(f"{name} level", "dB(A)", 50.0 + np.arange(n), 60.0, "#D55E00", "vehicle")
        for name in vehicles
    ]
    levels = rng.uniform(20.0, 70.0, (n + 1, len(vehicles), len(lines)))
    whole = InteractiveFront(
        title="Explore <me>",
        question="Which & why?",
        run="2026 seed 1",
        facts=("One load case.",),
        axes=tuple(axes),
        points=list(range(1, n + 1)),
        picks=["best-mean", *[""] * (n - 2), "sigma-kept"],
        vehicles=tuple(vehicles),
        vehicle_colours=("#0072B2",) * len(vehicles),
        frequency=lines,
        speed=30.0 * lines,
        levels=levels,
        full_scale=FULL_SCALE,
        pictures=(Picture(curve(), "A curve.", "The front."),),
    )
    return replace(whole, **changes)


def data_of(html, name="front"):
    """Return what the page holds."""
    pattern = rf'<script type="application/json" id="{name}">(.*?)</script>'
    return json.loads(re.search(pattern, html, re.S)[1])


@cache
def live_front(vehicles=("U06-1", "U06-5", "F39-1"), draws=32, limits=""):
    """Shipped vehicles with five designs and two picks of them, in a page that computes.

    - `limits`: file of limits of the run.
    """
    platform = deboom.read_platform("u06")
    runs = platform.runs(["g5_wot220"], fleet=platform.listeners(vehicles))
    model = runs.model("coupled")
    space = model.design_space()
    stated = ()
    if limits:
        of_mounts = read_mount_limits(limits, runs, space)
        stated = (*read_level_limits(limits, model), *of_mounts)
        stated += peak_rise_limits(1.0, model, space.nominal)
    robust = Robust(model, space, draws=draws, limits=stated)
    rng = np.random.default_rng(3)
    designs = rng.uniform(0.8, 1.2, (5, 12))
    starts = [Start("best-mean", designs[0]), Start("best-sigma", designs[4])]
    words = {
        "title": "Compact <b>platform",
        "run": "2026 seed 1",
        "study": "front",
        "newtons": [None, *(100.0 * k for k in range(1, 12))],
        "fullScale": FULL_SCALE,
        "seconds": 4.0,
    }
    live, refusal = live_page(robust, runs, starts, words)
    assert not refusal
    names = model.response_names
    levels = model.levels(np.vstack([np.ones(12), designs]))
    means = levels.mean(axis=-1)
    axes = [
        Axis(name, "1", designs[:, k], 1.0, "#332288", "variable", (0.8, 1.2), 100.0)
        for k, name in enumerate(model.variable_names)
    ]
    axes.append(Axis("mean level", "dB(A)", means[1:].mean(axis=1), 60.0, "#0B4F7D", "objective"))
    axes.append(Axis("σ", "dB", 1.0 - 0.05 * np.arange(5), 1.2, "#0B4F7D", "objective"))
    axes += [
        Axis(f"{name} level", "dB(A)", means[1:, v], means[0, v], "#D55E00", "vehicle")
        for v, name in enumerate(names)
    ]
    page = front(
        axes=tuple(axes),
        points=list(range(1, 6)),
        picks=["best-mean", "", "", "", "best-sigma"],
        vehicles=names,
        vehicle_colours=("#0072B2",) * len(names),
        frequency=model.frequency,
        speed=40.0 * model.frequency,
        levels=levels,
        live=live,
    )
    return page, robust
