"""Further mistakes in folders of campaigns, platforms, compressors and components.

``PYTHONPATH=tests python -m samples.later_mistakes --seeds 101`` judges them as those of
`samples.mistakes`. They were written down before any check was made for them.
"""

from __future__ import annotations

import re
import shutil
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
import openpyxl
import pandas as pd

from deboom.bench.campaign import CampaignPlan
from deboom.bench.campaign_writer import write_campaign
from deboom.bench.families import KINDS, draw_family
from deboom.bench.fleet import receptance
from deboom.files.kinds import FolderKind
from deboom.files.uff import UffFunction, read_uff
from samples.mistakes import (
    CARRIERS,
    CASES,
    MISTAKES,
    RUNS_ON_BENCH,
    SHORT_RUN,
    VEHICLES,
    Change,
    functions,
    jomega,
    main,
    matrix,
    mistake,
    number,
    only,
    operating,
    pick,
    places,
    sheet,
    table,
    text,
    times,
    transfer,
    two,
)

FIRST = len(MISTAKES)
LB, LBF_FT = 0.45359237, 1.3558179

on_campaign = partial(mistake, FolderKind.campaign)
on_platform = partial(mistake, FolderKind.platform)
on_compressor = partial(mistake, FolderKind.compressor)
on_component = partial(mistake, FolderKind.component)


def late(seconds: float) -> Change:
    """Delay functions."""
    return lambda f: times(np.exp(-jomega(f) * seconds))(f)


def conjugated(f: UffFunction) -> UffFunction:
    """Conjugate a function."""
    return replace(f, values=f.values.conj())


def at(nodes: Sequence[int], change: Change, axis: str = "") -> Change:
    """Change the functions of response nodes, along an axis."""
    return lambda f: (
        change(f) if f.response_node in nodes and f.response_direction.endswith(axis) else f
    )


def turned(f: UffFunction) -> UffFunction:
    """Turn a triaxial sensor by 90° about z: x is where y was."""
    axes = {"+x": "+y", "+y": "-x", "-x": "-y", "-y": "+x"}
    return replace(f, response_direction=axes.get(f.response_direction, f.response_direction))


def exchange(path: Path, first: int, second: int, *, reference: bool = False) -> None:
    """Exchange the cables of two nodes."""
    key, swap = "reference_node" if reference else "response_node", {first: second, second: first}
    functions(path, lambda f: replace(f, **{key: swap.get(getattr(f, key), getattr(f, key))}))


def add_remark(folder: Path, file: str) -> Sequence[str]:
    """Add a comment to a TOML file."""
    path = folder / file
    path.write_text("# measured on a Monday\n" + path.read_text())
    return (file,)


# ---- campaign

RUNS = ("g5_wot120", "g5_wot220", "g6_wot220")
CELLS = {"EnM": (31, 32), "GeM": (33, 34), "TSM": (35, 36)}
TORQUE_NODE = 201
PIECES = {"EnM": 101, "GeM": 102, "TSM": 103}


def runs(folder: Path, change: Change) -> None:
    """Change all runs of a campaign."""
    for path in sorted((folder / "runs/M1").glob("*.uff")):
        functions(path, change)


def _in_run(folder: Path, draw: np.random.Generator, change: Change) -> Sequence[str]:
    run = pick(draw, RUNS)
    functions(folder / f"runs/M1/{run}.uff", change)
    return (run,)


def _run_entry(folder: Path, run: str, key: str, change: Callable[[str], str]) -> Sequence[str]:
    text(
        folder / "campaign.toml",
        rf'(name = "{run}"\n(?:.*\n)*?{key} = )(\S+)',
        lambda m: m[1] + change(m[2]),
        count=1,
    )
    return (run,)


@on_campaign("a copied run under another name")
def _(folder, draw):
    first, second = two(draw, RUNS)
    shutil.copy(folder / f"runs/M1/{first}.uff", folder / f"runs/M1/{second}.uff")
    return (first, second)


@on_campaign("cell forces of one mount in kN labelled N")
def _(folder, draw):
    mount = pick(draw, CARRIERS)
    runs(folder, at(CELLS[mount], times(1e-3)))
    return (mount, *(f"C{node - 30}" for node in CELLS[mount]))


@on_campaign("static forces of one mount in kN labelled N")
def _(folder, draw):
    mount = pick(draw, CARRIERS)
    runs(folder, at([PIECES[mount]], times(1e-3)))
    return (mount,)


@on_campaign("static forces of all mounts reversed")
def _(folder, draw):
    runs(folder, at(list(PIECES.values()), times(-1.0)))
    return ("static force",)


def _curve(folder, draw, change):
    name = f"{pick(draw, CARRIERS)}_{pick(draw, 'xyz')}"
    path = folder / f"static_curves/M1/{name}.csv"
    rows = pd.read_csv(path)
    change(rows).to_csv(path, index=False)
    return (name, f"curve {name.replace('_', ' ')}")


@on_campaign("a static curve in mm under a header in m")
def _(folder, draw):
    return _curve(folder, draw, lambda r: r.rename(columns={"deflection [mm]": "deflection [m]"}))


@on_campaign("a static curve in kN under a header in N")
def _(folder, draw):
    return _curve(folder, draw, lambda r: r.assign(**{"force [N]": r["force [N]"] / 1e3}))


@on_campaign("a static curve of reversed sign")
def _(folder, draw):
    return _curve(folder, draw, lambda r: r.assign(**{"force [N]": -r["force [N]"]}))


@on_campaign("one static curve is a copy of another axis")
def _(folder, draw):
    mount, (first, second) = pick(draw, CARRIERS), two(draw, "xyz")
    curves = folder / "static_curves/M1"
    shutil.copy(curves / f"{mount}_{first}.csv", curves / f"{mount}_{second}.csv")
    return (mount,)


def in_lbf_ft(f: UffFunction) -> UffFunction:
    """Convert the engine torque."""
    return times(1 / LBF_FT)(f) if f.response_node == TORQUE_NODE and f.ordinate != "rpm" else f


@on_campaign("torque of one run in lbf ft labelled N m")
def _(folder, draw):
    return _in_run(folder, draw, in_lbf_ft)


@on_campaign("torque of all runs in lbf ft labelled N m")
def _(folder, draw):
    runs(folder, in_lbf_ft)
    return ("torque",)


@on_campaign("gear of a run off by one")
def _(folder, draw):
    run, step = pick(draw, RUNS), int(draw.choice([-1, 1]))
    return _run_entry(folder, run, "gear", lambda gear: str(int(gear) + step))


@on_campaign("torque limits of two runs exchanged")
def _(folder, draw):
    for run, limit in (("g5_wot120", "220.0"), ("g5_wot220", "120.0")):
        _run_entry(folder, run, "torque_nm", lambda _, limit=limit: limit)
    return ("g5_wot120", "g5_wot220")


@on_campaign("mass in lb")
def _(folder, draw):
    return (*number(folder / "campaign.toml", "mass_kg", lambda mass: mass / LB), "mass")


@on_campaign("one accelerometer in g labelled m/s2")
def _(folder, draw):
    node = int(draw.integers(1, 7))
    runs(folder, at([node], times(1 / 9.80665)))
    return (f"A{node}",)


@on_campaign("one accelerometer turned by 90 degrees")
def _(folder, draw):
    node = int(draw.integers(1, 7))
    runs(folder, at([node], turned))
    return (f"A{node}",)


@on_campaign("cables of two accelerometers exchanged")
def _(folder, draw):
    first, second = (int(n) for n in 1 + draw.choice(6, 2, replace=False))
    for run in RUNS:
        exchange(folder / f"runs/M1/{run}.uff", first, second)
    return (f"A{first}", f"A{second}")


@on_campaign("one axis of a force cell reversed")
def _(folder, draw):
    mount, axis = pick(draw, CARRIERS), pick(draw, "xyz")
    node = CELLS[mount][int(draw.integers(2))]
    runs(folder, at([node], times(-1.0), axis))
    return (mount, f"C{node - 30}")


@on_campaign("spectra of one run conjugated")
def _(folder, draw):
    return _in_run(folder, draw, lambda f: conjugated(f) if f.ordinate != "rpm" else f)


@on_campaign("one accelerometer channel late by 4 to 10 ms")
def _(folder, draw):
    node, axis = int(draw.integers(1, 7)), pick(draw, "xyz")
    delay = draw.uniform(4e-3, 10e-3)
    runs(folder, at([node], late(delay), axis))
    return (f"A{node}",)


@on_campaign("force cells on a recorder that is late by 4 to 10 ms")
def _(folder, draw):
    delay, cells = draw.uniform(4e-3, 10e-3), [n for nodes in CELLS.values() for n in nodes]
    runs(folder, at([*cells, 37, 38], late(delay)))
    return ("late", "cell force", "EnM", "GeM", "TSM")


@on_campaign("positions of the sensors in the axes of the vehicle")
def _(folder, draw):
    shift = [draw.uniform(0.8, 2.0), 0.0, draw.uniform(0.2, 0.7)]
    return (*places(folder / "sensors.csv", lambda p: p + shift), "sensor")


@on_campaign("one run as RMS", visible=False)
def _(folder, draw):
    keep = ("rpm",)
    change = lambda f: times(np.sqrt(0.5))(f) if f.ordinate not in keep else f  # noqa: E731
    return _in_run(folder, draw, only("acceleration", change))


@on_campaign("rows of the sensors in another order", harmless=True)
def _(folder, draw):
    table(folder / "sensors.csv", lambda rows: rows.sample(frac=1.0, random_state=draw))
    return ("sensors.csv",)


@on_campaign("a remark above the keys", harmless=True)
def _(folder, draw):
    return add_remark(folder, "campaign.toml")


# ---- platform


@on_platform("sign lost at one coordinate")
def _(folder, draw):
    n = int(draw.integers(3))
    axis = {0: [1, 2], 1: [1, 2], 2: [0, 2]}[n][int(draw.integers(2))]

    def change(p):
        p[n, axis] *= -1
        return p

    return (*places(folder / "mounts.csv", change), CARRIERS[n])


@on_platform("y pasted over x")
def _(folder, draw):
    return places(folder / "mounts.csv", lambda p: p[:, [1, 1, 2]])


@on_platform("torque limit in lbf ft")
def _(folder, draw):
    return number(folder / "platform.toml", "torque_limit_nm", lambda limit: limit / LBF_FT)


@on_platform("torque of one load case in lbf ft")
def _(folder, draw):
    case = pick(draw, CASES)
    table(
        folder / f"operating/{case}_torque.csv",
        lambda rows: rows.assign(
            **{"engine torque [N m]": rows["engine torque [N m]"].astype(float) / LBF_FT}
        ),
    )
    return (case,)


@on_platform("one force channel late by 4 to 10 ms")
def _(folder, draw):
    n, axis, delay = int(draw.integers(3)), pick(draw, "xyz"), draw.uniform(4e-3, 10e-3)
    operating(folder, only("force", at([101 + n], late(delay), axis)))
    return (f"{CARRIERS[n]} {axis}",)


@on_platform("one displacement channel late by 4 to 10 ms")
def _(folder, draw):
    n, axis, delay = int(draw.integers(3)), pick(draw, "xyz"), draw.uniform(4e-3, 10e-3)
    operating(folder, only("displacement", at([101 + n], late(delay), axis)))
    return (f"{CARRIERS[n]} {axis}",)


@on_platform("forces of one mount late by 4 to 10 ms")
def _(folder, draw):
    n, delay = int(draw.integers(3)), draw.uniform(4e-3, 10e-3)
    operating(folder, only("force", at([101 + n], late(delay))))
    return (CARRIERS[n],)


@on_platform("all forces late by 2 to 6 ms")
def _(folder, draw):
    delay = draw.uniform(2e-3, 6e-3)
    operating(folder, only("force", late(delay)))
    return ("late", "loss factor")


@on_platform("x and z exchanged in one load case")
def _(folder, draw):
    case, n, swap = pick(draw, CASES), int(draw.integers(3)), {"+x": "+z", "+z": "+x"}
    functions(
        folder / f"operating/{case}.uff",
        only(
            "displacement",
            lambda f: replace(f, response_direction=swap.get(f.response_direction, "+y")),
            [101 + n],
        ),
    )
    return (case,)


@on_platform("forces of another run in one load case")
def _(folder, draw):
    first, second = two(draw, CASES)
    other = {
        (f.response_node, f.response_direction): f.values
        for f in read_uff(folder / f"operating/{second}.uff")
        if f.ordinate == "force"
    }
    functions(
        folder / f"operating/{first}.uff",
        only(
            "force",
            lambda f: replace(f, values=other[f.response_node, f.response_direction]),
        ),
    )
    return (first,)


@on_platform("forces of one load case ahead by 35 to 60 degrees")
def _(folder, draw):
    case, angle = pick(draw, CASES), np.deg2rad(draw.uniform(35, 60))
    functions(folder / f"operating/{case}.uff", only("force", times(np.exp(1j * angle))))
    return (case,)


def _mean_of_magnitudes(f: UffFunction) -> UffFunction:
    return replace(f, values=np.abs(f.values) * (1 + 0.01j))


@on_platform("means of magnitudes with 1 % imaginary part, one vehicle")
def _(folder, draw):
    return transfer(folder, draw, _mean_of_magnitudes)


@on_platform("means of magnitudes with 1 % imaginary part, all vehicles")
def _(folder, draw):
    for vehicle in VEHICLES:
        functions(folder / f"noise_transfer/{vehicle}.uff", _mean_of_magnitudes)
    return ("magnitude",)


@on_platform("phase between force and displacement lost, run by run")
def _(folder, draw):
    for case in CASES:
        angles: list[complex] = []

        def change(f, angles=angles):
            if not angles:
                angles.append(np.exp(1j * draw.uniform(0, 2 * np.pi, f.values.size)))
            return times(angles[0])(f)

        functions(folder / f"operating/{case}.uff", only("force", change))
    return ("phase",)


@on_platform("trim removed in one vehicle, 10 dB")
def _(folder, draw):
    return transfer(folder, draw, times(10**0.5))


@on_platform("one path of a vehicle times 10")
def _(folder, draw):
    vehicle, n = pick(draw, VEHICLES), int(draw.integers(10))
    count = iter(range(100))
    functions(
        folder / f"noise_transfer/{vehicle}.uff",
        lambda f: times(10.0 if next(count) == n else 1)(f),
    )
    return (vehicle,)


@on_platform("force of one vehicle's hammer in lb labelled N")
def _(folder, draw):
    return transfer(folder, draw, times(1 / (LB * 9.80665)))


@on_platform("hum of the mains in one vehicle")
def _(folder, draw):
    def change(f):
        values = f.values.copy()
        values[np.argmin(np.abs(f.abscissa - 50.0))] += 8 * np.abs(values).max()
        return replace(f, values=values)

    return transfer(folder, draw, change)


@on_platform("range of an amplifier switched within one vehicle's functions")
def _(folder, draw):
    split = draw.uniform(35, 60)
    return transfer(folder, draw, lambda f: times(np.where(f.abscissa < split, 1.0, 10.0))(f))


@on_platform("one triaxial sensor times 10")
def _(folder, draw):
    n = int(draw.integers(3))
    operating(folder, only("displacement", times(10.0), [101 + n]))
    return (CARRIERS[n],)


@on_platform("mass in lb")
def _(folder, draw):
    return (*number(folder / "platform.toml", "mass_kg", lambda mass: mass / LB), "mass")


@on_platform("gear of a load case off by one", visible=False)
def _(folder, draw):
    case = pick(draw, CASES)
    text(
        folder / "platform.toml",
        rf'(name = "{case}"\n(?:.*\n)*?gear = )(\d)',
        lambda m: m[1] + str(int(m[2]) - 1),
        count=1,
    )
    return (case,)


@on_platform("rows of the channels in another order", harmless=True)
def _(folder, draw):
    table(folder / "channels.csv", lambda rows: rows.sample(frac=1.0, random_state=draw))
    return ("channels.csv",)


@on_platform("a remark above the keys", harmless=True)
def _(folder, draw):
    return add_remark(folder, "platform.toml")


# ---- compressor


def _positions(folder: Path, name: str, change: Callable[[np.ndarray], np.ndarray]) -> None:
    """Change the positions of a sheet [mm]."""

    def change_rows(rows):
        columns = [f"{axis} [mm]" for axis in "xyz"]
        rows[columns] = change(rows[columns].to_numpy(dtype=float))

    sheet(folder / "positions.xlsx", name, change_rows)


SHEETS = ("position", "positions.xlsx", *(f"A{n}" for n in range(1, 7)))


@on_compressor("rows of the sensors' positions shifted by one")
def _(folder, draw):
    _positions(folder, "sensors", lambda p: np.roll(p, 1, axis=0))
    return SHEETS


@on_compressor("one sensor 30 mm off along x")
def _(folder, draw):
    n = int(draw.integers(6))
    _positions(folder, "sensors", lambda p: p + 30.0 * np.outer(np.eye(6)[n], [1, 0, 0]))
    return (f"A{n + 1}",)


@on_compressor("one sensor in g labelled m/s2")
def _(folder, draw):
    node = 101 + int(draw.integers(6))
    functions(folder / "frf.uff", at([node], times(1 / 9.80665)))
    return (f"A{node - 100}",)


@on_compressor("one sensor turned by 90 degrees")
def _(folder, draw):
    node = 101 + int(draw.integers(6))
    functions(folder / "frf.uff", at([node], turned))
    return (f"A{node - 100}",)


@on_compressor("an impact mirrored to the other side")
def _(folder, draw):
    n, axis = int(draw.integers(18)), int(draw.integers(1, 3))

    def change(p):
        p[n, axis] *= -1
        return p

    _positions(folder, "impacts", change)
    return (f"I{n + 1:02}",)


@on_compressor("drawn stiffness of one mount in N/mm beside N/m")
def _(folder, draw):
    n, count = int(draw.integers(3)), iter(range(3))
    change = lambda k: k / 1e3 if next(count) == n else k  # noqa: E731
    return (*matrix(folder / "compressor_test.toml", "stiffness_n_per_m", change), f"mount {n + 1}")


@on_compressor("drawn inertia times 4")
def _(folder, draw):
    return (
        *matrix(folder / "compressor_test.toml", "inertia_kg_m2", lambda j: 4 * j),
        "drawing",
    )


@on_compressor("weighed with its bracket")
def _(folder, draw):
    share = draw.uniform(1.08, 1.3)
    return (
        *number(folder / "compressor_test.toml", "weighed_mass_kg", lambda m: share * m),
        "scales",
        "weighed",
    )


@on_compressor("weighed in lb")
def _(folder, draw):
    return (
        *number(folder / "compressor_test.toml", "weighed_mass_kg", lambda m: m / LB),
        "scales",
        "weighed",
    )


@on_compressor("a hidden old sheet before the right one")
def _(folder, draw):
    path = folder / "positions.xlsx"
    book = openpyxl.load_workbook(path)
    rows = list(book["sensors"].values)
    book["sensors"].title = "sensors new"
    old = book.create_sheet("sensors", 0)
    for n, row in enumerate(rows):
        old.append(row if n == 0 else (*row[:2], row[2] + 40, *row[3:]))
    old.sheet_state = "hidden"
    book.active = 1
    book.save(path)
    return ("hidden",)


@on_compressor("direction of an impact on another axis")
def _(folder, draw):
    n = int(draw.integers(18))

    def change(rows):
        rows[["dx", "dy", "dz"]] = [
            [*row[1:], row[0]] if k == n else list(row)
            for k, row in enumerate(rows[["dx", "dy", "dz"]].to_numpy())
        ]

    sheet(folder / "positions.xlsx", "impacts", change)
    return (f"I{n + 1:02}", f"node {201 + n}")


@on_compressor("hits of one impact times 10")
def _(folder, draw):
    node = 201 + int(draw.integers(18))
    functions(folder / "frf.uff", lambda f: times(10.0)(f) if f.reference_node == node else f)
    return (f"I{node - 200:02}",)


@on_compressor("one channel late by 4 to 10 ms")
def _(folder, draw):
    node, axis, delay = 101 + int(draw.integers(6)), pick(draw, "xyz"), draw.uniform(4e-3, 10e-3)
    functions(folder / "frf.uff", at([node], late(delay), axis))
    return (f"A{node - 100}",)


@on_compressor("sensors mirrored in y, impacts not")
def _(folder, draw):
    _positions(folder, "sensors", lambda p: p * [1, -1, 1])
    return SHEETS


@on_compressor("lines in rad/s")
def _(folder, draw):
    for name in ("frf", "coherence"):
        functions(folder / f"{name}.uff", lambda f: replace(f, abscissa=2 * np.pi * f.abscissa))
    return ("line", "Hz", "rad/s", "mounts")


@on_compressor("coherence that is 1 at all lines")
def _(folder, draw):
    functions(folder / "coherence.uff", lambda f: replace(f, values=np.ones_like(f.values)))
    return ("coherence",)


@on_compressor("impact positions from another origin")
def _(folder, draw):
    shift = [draw.uniform(80, 150), 0.0, draw.uniform(-80, 80)]
    _positions(folder, "impacts", lambda p: p + shift)
    return (*SHEETS, "origin")


@on_compressor("number of averages twice too large", visible=False)
def _(folder, draw):
    return number(folder / "compressor_test.toml", "weighed_mass_deviation_kg", lambda d: 2 * d)


@on_compressor("rows of the impacts in another order", harmless=True)
def _(folder, draw):
    def change(rows):
        rows[:] = rows.iloc[draw.permutation(len(rows))].to_numpy()

    sheet(folder / "positions.xlsx", "impacts", change)
    return ("impacts",)


@on_compressor("a remark above the keys", harmless=True)
def _(folder, draw):
    return add_remark(folder, "compressor_test.toml")


# ---- component

POINT_SENSORS = tuple(f"P{p} S{n}" for p in (1, 2, 3) for n in (1, 2, 3))
SPECTRA = ("steady_1", "steady_2")
_NAMES = {"steady_1": "steady 1", "steady_2": "steady 2"}


def _everywhere(folder: Path, change: Change) -> None:
    """Change functions and runs of the source in the first car, and of the free source."""
    for name in ("accelerance", "source_free", "runs/steady_1", "runs/steady_2"):
        functions(folder / f"{name}.uff", change)


@on_component("positions of two points exchanged")
def _(folder, draw):
    points = iter([("0.6", "0.33", "0.03"), ("0.55", "-0.34", "-0.02"), ("0.98", "0.04", "-0.08")])
    text(
        folder / "component.toml",
        r"^position_m = .*$",
        lambda _: f"position_m = [{', '.join(next(points))}]",
    )
    return ("point 1", "point 2")


@on_component("sensors of two points exchanged")
def _(folder, draw):
    swap = {"P1": "P2", "P2": "P1"}
    text(
        folder / "component.toml",
        r'^sensors = \["(P[12]).*$',
        lambda m: m[0].replace(m[1], swap[m[1]]),
    )
    return ("point 1", "point 2")


@on_component("one sensor times 10")
def _(folder, draw):
    n = int(draw.integers(9))
    _everywhere(folder, at([401 + n], times(10.0)))
    return (POINT_SENSORS[n],)


@on_component("one sensor turned by 90 degrees")
def _(folder, draw):
    n = int(draw.integers(9))
    _everywhere(folder, at([401 + n], turned))
    return (POINT_SENSORS[n],)


@on_component("cables of two sensors at one point exchanged")
def _(folder, draw):
    point, (first, second) = int(draw.integers(3)), draw.choice(3, 2, replace=False)
    nodes = [401 + 3 * point + int(n) for n in (first, second)]
    for name in ("accelerance", "source_free", *(f"runs/{run}" for run in SPECTRA)):
        exchange(folder / f"{name}.uff", *nodes)
    return tuple(POINT_SENSORS[n - 401] for n in nodes)


@on_component("one channel late by 4 to 10 ms")
def _(folder, draw):
    n, axis, delay = int(draw.integers(9)), pick(draw, "xyz"), draw.uniform(4e-3, 10e-3)
    _everywhere(folder, at([401 + n], late(delay), axis))
    return (POINT_SENSORS[n],)


@on_component("spectra of one run conjugated")
def _(folder, draw):
    run = pick(draw, SPECTRA)
    functions(folder / f"runs/{run}.uff", conjugated)
    return (_NAMES[run],)


@on_component("spectra of all runs conjugated")
def _(folder, draw):
    for run in SPECTRA:
        functions(folder / f"runs/{run}.uff", conjugated)
    return ("conjugated",)


@on_component("free functions are the coupled ones")
def _(folder, draw):
    coupled = {
        (f.response_node, f.response_direction, f.reference_name): f.values
        for f in read_uff(folder / "accelerance.uff")
    }
    functions(
        folder / "source_free.uff",
        lambda f: replace(
            f, values=coupled[f.response_node, f.response_direction, f.reference_name]
        ),
    )
    return ("free",)


@on_component("free functions conjugated")
def _(folder, draw):
    functions(folder / "source_free.uff", conjugated)
    return ("free",)


@on_component("receiver is a copy of the first car")
def _(folder, draw):
    for name in ("accelerance", "pressure"):
        shutil.copy(folder / f"{name}.uff", folder / f"receiver/{name}.uff")
    return ("receiver",)


@on_component("functions conjugated")
def _(folder, draw):
    functions(folder / "accelerance.uff", conjugated)
    return ("accelerance", "conjugated")


@on_component("mobility written as accelerance")
def _(folder, draw):
    functions(folder / "accelerance.uff", lambda f: times(1 / jomega(f))(f))
    return ("accelerance", "mobility")


@on_component("one run in g labelled m/s2")
def _(folder, draw):
    run = pick(draw, SPECTRA)
    functions(folder / f"runs/{run}.uff", only("acceleration", times(1 / 9.80665)))
    return (_NAMES[run],)


@on_component("two runs from one content")
def _(folder, draw):
    shutil.copy(folder / "runs/steady_1.uff", folder / "runs/steady_2.uff")
    return tuple(_NAMES.values())


@on_component("an impact reversed")
def _(folder, draw):
    node, axis = 501 + int(draw.integers(9)), pick(draw, "xyz")
    for name in ("accelerance", "source_free"):
        functions(
            folder / f"{name}.uff",
            lambda f: (
                times(-1.0)(f)
                if f.reference_node == node and f.reference_direction.endswith(axis)
                else f
            ),
        )
    return (f"P{1 + (node - 501) // 3} I{1 + (node - 501) % 3}{axis}",)


@on_component("rows of the impacts' positions shifted by one")
def _(folder, draw):
    _positions(folder, "impacts", lambda p: np.roll(p, 1, axis=0))
    return ("positions.xlsx", "position")


@on_component("one microphone times 10 in the runs")
def _(folder, draw):
    node = 901 + int(draw.integers(2))
    for run in SPECTRA:
        functions(folder / f"runs/{run}.uff", at([node], times(10.0)))
    return (("driver ear", "passenger ear")[node - 901],)


@on_component("pressure per kN labelled N")
def _(folder, draw):
    functions(folder / "pressure.uff", lambda f: times(1e3)(f) if f.function_type == 4 else f)
    return ("pressure",)


@on_component("loss factor of the receiver's mounts in percent")
def _(folder, draw):
    return number(folder / "receiver/receiver.toml", "loss_factor", lambda loss: 100 * loss)


@on_component("microphones of both ears reversed, everywhere", harmless=True)
def _(folder, draw):
    for name in ("pressure", *(f"runs/{run}" for run in SPECTRA)):
        functions(folder / f"{name}.uff", only("pressure", lambda f: times(-1.0)(f)))
    return ("ear",)


@on_component("a remark above the keys", harmless=True)
def _(folder, draw):
    return add_remark(folder, "component.toml")


# ---- of later rounds, so that the draws above stay


def _over_time(folder: Path, change: Change) -> Sequence[str]:
    """Add a run that was recorded over time, changed."""
    source = folder.with_name("over_time")
    plan = CampaignPlan(("M1",), RUNS_ON_BENCH[1:2], 1, time_run=SHORT_RUN)
    seed = re.search(
        r'^name = "virtual_bench_(\d+)"$', (folder / "campaign.toml").read_text(), re.M
    )
    write_campaign(source, int(seed[1]), plan)
    shutil.copytree(source / "time", folder / "time")
    section = (source / "campaign.toml").read_text().partition("[[time_runs]]")
    with (folder / "campaign.toml").open("a") as file:
        file.write("".join(section[1:]))
    shutil.rmtree(source)
    functions(folder / "time/g5_wot220_time.uff", change)
    return ("g5_wot220_time",)


@on_campaign("a run over time that falls, stated as rising")
def _(folder, draw):
    run = _over_time(folder, lambda f: f)
    return _run_entry(folder, run[0], "rising", lambda _: "false")


@on_campaign("pulses per revolution of a run over time doubled")
def _(folder, draw):
    run = _over_time(folder, lambda f: f)
    return _run_entry(folder, run[0], "pulses_per_revolution", lambda n: str(2 * int(n)))


@on_campaign("torque of a run over time in lbf ft labelled N m")
def _(folder, draw):
    return _over_time(folder, in_lbf_ft)


@on_campaign("one accelerometer channel of a run over time reversed")
def _(folder, draw):
    node, axis = int(draw.integers(1, 7)), pick(draw, "xz")
    return (*_over_time(folder, at([node], times(-1.0), axis)), f"A{node}")


@on_platform("absolute displacements, of a powertrain on a body that moves")
def _(folder, draw):
    kind, seed = pick(draw, tuple(KINDS)), int(draw.integers(2, 1000))
    fleet = draw_family(kind, seed, seed).fleet()
    body = fleet.bodies[pick(draw, VEHICLES)]
    at_body = {path: n for n, path in enumerate(fleet.paths)}

    def channel(f):
        return f"{CARRIERS[f.response_node - 101]} {f.response_direction[-1]}"

    for case in CASES:
        path = folder / f"operating/{case}.uff"
        force = {
            channel(f): f.values
            for f in read_uff(path)
            if f.ordinate == "force" and f.response_node <= 103
        }

        def moved(f, force=force):
            rows = receptance(body, f.abscissa)[:, at_body[channel(f)]]
            return replace(
                f,
                values=f.values
                + sum(rows[:, at_body[name]] * push for name, push in force.items()),
            )

        functions(path, only("displacement", moved, (101, 102, 103)))
    return ("absolute", "relative")


LATER = tuple(MISTAKES[FIRST:])

if __name__ == "__main__":
    main(LATER)
