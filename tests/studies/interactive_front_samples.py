"""A made-up front for the interactive page: three mounts, two vehicles, seven uneven lines."""

import json
import re
from dataclasses import replace
from functools import cache

import numpy as np

from deboom.plot import CurvePanel, curve_panels
from deboom.plot.style import as_png
from deboom.report.interactive import Axis, InteractiveFront
from deboom.report.report import Picture

N, MOUNTS, VEHICLES = 9, ("Front", "Roll stop", "Rear"), ("Wagon", '</script><b>Cabrio, "R"')
LINES = np.array([14.0, 15.1, 15.9, 18.0, 21.5, 30.0, 33.3])
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
        levels=rng.uniform(20.0, 70.0, (n + 1, len(vehicles), len(lines))),
        pictures=(Picture(curve(), "A curve.", "The front."),),
    )
    return replace(whole, **changes)


def data_of(html):
    """Return what the page holds."""
    script = re.search(r'<script type="application/json" id="front">(.*?)</script>', html, re.S)
    return json.loads(script[1])
