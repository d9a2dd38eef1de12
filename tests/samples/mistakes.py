"""Mistakes that people make in folders of measurements, each built on a folder without any.

``python tests/samples/mistakes.py --seeds 101 102`` builds every mistake once per seed, at a place
and of a size that the seed draws, and says what ``deboom check`` makes of it. A mistake is named if
a fault, a WARNING or an ALARM that the folder did not have before holds one of the words that tell
where it is: a channel, a vehicle, a key, a file. What cannot be seen in any data is built too, and
counted apart. Seeds to `LAST_TUNING` are for tuning, later ones judge.
"""

from __future__ import annotations

import argparse
import re
import shutil
import tempfile
import warnings
from collections import defaultdict
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import cache, partial
from pathlib import Path

import numpy as np
import openpyxl
import pandas as pd
from numpy.random import Generator

from deboom.bench.campaign import CampaignPlan, TimeRunPlan
from deboom.bench.campaign_writer import write_campaign
from deboom.bench.choices import CalibrationLevel
from deboom.bench.component_writer import write_component_test
from deboom.bench.compressor_truth import CompressorPlan
from deboom.bench.compressor_writer import write_compressor_test, write_operating_test
from deboom.bench.families import BRACKETS, FACTORS, KINDS, draw_family
from deboom.bench.operating_run import PlannedRun
from deboom.bench.platform_writer import write_platform
from deboom.bench.powertrain import load_bench
from deboom.bench.vehicle_writer import write_vehicle
from deboom.errors import DataWarning
from deboom.files.check import check_folder
from deboom.files.kinds import FolderKind
from deboom.files.uff import AxisDriftWarning, UffFunction, read_uff, write_uff
from deboom.physics.sound_level import a_weighting

LAST_TUNING = 100
"""Last seed that may be looked at while the checks are written."""
CARRIERS = ("EnM", "GeM", "TSM")
"""Mounts that carry the powertrain."""
PATHS = (*(f"{mount} {axis}" for mount in CARRIERS for axis in "xyz"), "Du x")
VEHICLES = tuple(f"{group}-{n}" for group in ("U06", "F39", "F45") for n in range(1, 6))
CASES = ("g5_wot120", "g5_wot220", "g6_wot120", "g6_wot160", "g6_wot220", "g7_wot220")

Make = Callable[[Path, Generator], Sequence[str]]
"""Changes a folder, and returns words of which a sentence on the mistake holds at least one."""
Change = Callable[[UffFunction], UffFunction]


@dataclass(frozen=True)
class Mistake:
    """One mistake: the kind of folder, what was done, how, and whether any data can show it.

    - `harmless`: it changes no result, so that nothing needs to be said.
    """

    folder: FolderKind
    name: str
    make: Make
    visible: bool = True
    harmless: bool = False


MISTAKES: list[Mistake] = []


def mistake(
    folder: FolderKind, name: str, *, visible: bool = True, harmless: bool = False
) -> Callable[[Make], Make]:
    """Add a mistake to the list."""

    def add(make: Make) -> Make:
        MISTAKES.append(Mistake(folder, name, make, visible and not harmless, harmless))
        return make

    return add


on_platform = partial(mistake, FolderKind.platform)
on_compressor = partial(mistake, FolderKind.compressor)
on_vehicle = partial(mistake, FolderKind.vehicle)
on_campaign = partial(mistake, FolderKind.campaign)
on_operation = partial(mistake, FolderKind.operation)


# ---- how files are changed


def text(
    path: Path, pattern: str, new: str | Callable[[re.Match[str]], str], count: int = 0
) -> None:
    """Replace a pattern in a text file; it must be there."""
    changed, n = re.subn(pattern, new, path.read_text(), count=count, flags=re.MULTILINE)
    if not n:
        raise ValueError(f"{path} has no {pattern}")
    path.write_text(changed)


def number(path: Path, key: str, change: Callable[[float], float], count: int = 0) -> Sequence[str]:
    """Change the number of a key of a TOML file."""
    text(path, rf"^{key} = (\S+)$", lambda m: f"{key} = {float(change(float(m[1])))!r}", count)
    return (key,)


def matrix(path: Path, key: str, change: Callable[[np.ndarray], np.ndarray]) -> Sequence[str]:
    """Change the list of numbers of a key of a TOML file."""

    def changed(match: re.Match[str]) -> str:
        values = np.array(eval(match[1], {"__builtins__": {}}))
        return f"{key} = {np.asarray(change(values)).tolist()}"

    text(path, rf"^{key} = (\[.*\])$", changed)
    return (key,)


def table(path: Path, change: Callable[[pd.DataFrame], pd.DataFrame | None]) -> None:
    """Change a table of texts: CSV."""
    rows = pd.read_csv(path, dtype=str, keep_default_na=False)
    changed = change(rows)
    (rows if changed is None else changed).to_csv(path, index=False)


def places(path: Path, change: Callable[[np.ndarray], np.ndarray]) -> Sequence[str]:
    """Change the positions (n, 3) of a CSV table [m]."""

    def change_rows(rows: pd.DataFrame) -> None:
        columns = [f"{axis} [m]" for axis in "xyz"]
        values = change(rows[columns].to_numpy(dtype=float))
        for column, new in zip(columns, values.T, strict=True):
            rows[column] = [f"{value:.6g}" for value in new]

    table(path, change_rows)
    return ("position", path.name)


def sheet(path: Path, name: str, change: Callable[[pd.DataFrame], None]) -> None:
    """Change a sheet of a workbook."""
    book = openpyxl.load_workbook(path)
    cells = list(book[name].values)
    rows = pd.DataFrame(cells[1:], columns=cells[0])
    change(rows)
    for n, row in enumerate([list(rows.columns), *rows.to_numpy(dtype=object).tolist()], 1):
        for column, value in enumerate(row, 1):
            book[name].cell(n, column, value)
    book.save(path)


def functions(path: Path, change: Change) -> None:
    """Change every function of a UFF file."""
    write_uff(path, [change(function) for function in read_uff(path)])


def times(factor: object) -> Change:
    """Multiply functions, by a number or a number per line."""
    return lambda f: replace(f, values=f.values * factor)


def only(quantity: str, change: Change, nodes: Sequence[int] = ()) -> Change:
    """Change the functions of a quantity, at nodes."""
    return lambda f: (
        change(f) if f.ordinate == quantity and (not nodes or f.response_node in nodes) else f
    )


def operating(folder: Path, change: Change) -> Sequence[str]:
    """Change the spectra of all load cases."""
    for path in sorted((folder / "operating").glob("*.uff")):
        functions(path, change)
    return ("load case", "displacement", "force", "stiffness")


def transfer(folder: Path, draw: Generator, change: Change) -> Sequence[str]:
    """Change the noise transfer functions of a vehicle that is drawn."""
    vehicle = pick(draw, VEHICLES)
    functions(folder / f"noise_transfer/{vehicle}.uff", change)
    return (vehicle,)


def pick(draw: Generator, choices: Sequence[str]) -> str:
    """Draw one of several names."""
    return choices[int(draw.integers(len(choices)))]


def two(draw: Generator, choices: Sequence[str]) -> tuple[str, str]:
    """Draw two of several names."""
    first, second = draw.choice(len(choices), 2, replace=False)
    return choices[int(first)], choices[int(second)]


def jomega(function: UffFunction) -> np.ndarray:
    """``jω`` of the lines of a function [rad/s]."""
    return 2j * np.pi * function.abscissa


def one_of(path: Path, draw: Generator, change: Change, ordinate: str = "") -> UffFunction:
    """Change one function of a file, which is drawn and returned as it was."""
    functions = read_uff(path)
    which = [n for n, each in enumerate(functions) if ordinate in ("", each.ordinate)]
    n = which[int(draw.integers(len(which)))]
    write_uff(path, [change(each) if k == n else each for k, each in enumerate(functions)])
    return functions[n]


def channel_of(function: UffFunction) -> str:
    """``EnM x`` of a function of a platform, from its ID line."""
    return re.split(r", ", function.id_lines[0])[-1]


# ---- platform: positions


@on_platform("columns x and y of the positions swapped")
def _(folder, draw):
    return places(folder / "mounts.csv", lambda p: p[:, [1, 0, 2]])


@on_platform("mounts mirrored, left for right")
def _(folder, draw):
    return places(folder / "mounts.csv", lambda p: p * [1, -1, 1])


@on_platform("x of the mounts forward")
def _(folder, draw):
    return places(folder / "mounts.csv", lambda p: p * [-1, 1, 1])


@on_platform("positions in the axes of the vehicle, not from the centre of gravity")
def _(folder, draw):
    shift = [draw.uniform(0.8, 2.0), draw.uniform(-0.1, 0.1), draw.uniform(0.2, 0.7)]
    return (*places(folder / "mounts.csv", lambda p: p + shift), "centre of gravity")


@on_platform("rows of two mounts exchanged")
def _(folder, draw):
    first, second = draw.choice(3, 2, replace=False)

    def change(p):
        p[[first, second]] = p[[second, first]]
        return p

    return places(folder / "mounts.csv", change)


@on_platform("positions in mm under a header in m")
def _(folder, draw):
    return places(folder / "mounts.csv", lambda p: 1000 * p)


@on_platform("positions in cm under a header in mm")
def _(folder, draw):
    return places(folder / "mounts.csv", lambda p: p / 10)


# ---- platform: operating spectra


@on_platform("sign of all forces")
def _(folder, draw):
    return operating(folder, only("force", times(-1)))


@on_platform("sign of the forces of one mount")
def _(folder, draw):
    n = int(draw.integers(3))
    operating(folder, only("force", times(-1), [101 + n]))
    return (CARRIERS[n],)


@on_platform("sign of all displacements")
def _(folder, draw):
    return operating(folder, only("displacement", times(-1)))


@on_platform("one channel reversed in displacement and force")
def _(folder, draw):
    n, axis = int(draw.integers(3)), pick(draw, "xyz")
    operating(
        folder,
        lambda f: (
            times(-1)(f) if (f.response_node, f.response_direction[-1]) == (101 + n, axis) else f
        ),
    )
    return (f"{CARRIERS[n]} {axis}",)


@on_platform("operating spectra conjugated")
def _(folder, draw):
    return operating(folder, lambda f: replace(f, values=f.values.conj()))


@on_platform("operating spectra as RMS", visible=False)
def _(folder, draw):
    return operating(folder, times(np.sqrt(0.5)))


@on_platform("operating spectra peak to peak", visible=False)
def _(folder, draw):
    return operating(folder, times(2.0))


@on_platform("displacements alone as RMS")
def _(folder, draw):
    return (*operating(folder, only("displacement", times(np.sqrt(0.5)))), "mass")


for _name, _factor in {
    "acceleration written as displacement": lambda f: jomega(f) ** 2,
    "acceleration in g written as displacement": lambda f: jomega(f) ** 2 / 9.80665,
    "velocity written as displacement": jomega,
    "displacement in mm labelled m": lambda f: 1e3,
    "displacement in um labelled m": lambda f: 1e6,
    "displacement in m labelled mm": lambda f: 1e-3,
}.items():

    @on_platform(_name)
    def _(folder, draw, factor=_factor):
        return operating(folder, only("displacement", lambda f: times(factor(f))(f)))


@on_platform("force in kN labelled N")
def _(folder, draw):
    return operating(folder, only("force", times(1e-3)))


@on_platform("displacement of the body's side")
def _(folder, draw):
    compliance = 10 ** draw.uniform(-7.7, -7.0) * (1 - 0.05j)
    for path in sorted((folder / "operating").glob("*.uff")):
        functions = read_uff(path)
        force = {
            (f.response_node, f.response_direction): f for f in functions if f.ordinate == "force"
        }
        write_uff(
            path,
            [
                replace(f, values=compliance * force[f.response_node, f.response_direction].values)
                if f.ordinate == "displacement"
                else f
                for f in functions
            ],
        )
    return ("displacement", "stiffness", "load case")


@on_platform("phases of the operating spectra lost")
def _(folder, draw):
    return operating(folder, lambda f: replace(f, values=np.abs(f.values) + 0j))


@on_platform("a sensor drops out to zero in a band")
def _(folder, draw):
    case, first = pick(draw, CASES), int(draw.integers(10, 150))

    def change(f):
        values = f.values.copy()
        values[first : first + int(draw.integers(4, 12))] = 0
        return replace(f, values=values)

    hit = one_of(folder / f"operating/{case}.uff", draw, change, "displacement")
    return (channel_of(hit),)


@on_platform("a force is zero at all lines")
def _(folder, draw):
    path = folder / f"operating/{pick(draw, CASES)}.uff"
    return (channel_of(one_of(path, draw, times(0), "force")),)


@on_platform("a force is constant")
def _(folder, draw):
    path = folder / f"operating/{pick(draw, CASES)}.uff"
    hit = one_of(path, draw, lambda f: replace(f, values=0 * f.values + f.values.mean()), "force")
    return (channel_of(hit),)


@on_platform("lines of a channel shifted")
def _(folder, draw):
    path, lines = folder / f"operating/{pick(draw, CASES)}.uff", int(draw.integers(3, 9))
    shifted = lambda f: replace(f, values=np.roll(f.values, lines))  # noqa: E731
    return (channel_of(one_of(path, draw, shifted, "force")),)


@on_platform("band of a load case zero-padded")
def _(folder, draw):
    case = pick(draw, CASES)
    functions(folder / f"operating/{case}.uff", lambda f: times(f.abscissa < 61)(f))
    return (case,)


@on_platform("two load cases from one file")
def _(folder, draw):
    first, second = two(draw, CASES)
    text(folder / "platform.toml", f'"operating/{first}.uff"', f'"operating/{second}.uff"')
    return (first, second)


@on_platform("files of two load cases exchanged")
def _(folder, draw):
    first, second = two(draw, CASES)
    path, names = folder / "platform.toml", {first: second, second: first}
    text(path, rf'"operating/({first}|{second})\.uff"', lambda m: f'"operating/{names[m[1]]}.uff"')
    return (first, second)


@on_platform("left and right piece exchanged", visible=False)
def _(folder, draw):
    return operating(
        folder,
        lambda f: replace(
            f, response_node={111: 112, 112: 111}.get(f.response_node, f.response_node)
        ),
    )


# ---- platform: noise transfer functions


@on_platform("noise transfer functions of a vehicle conjugated")
def _(folder, draw):
    return transfer(folder, draw, lambda f: replace(f, values=f.values.conj()))


@on_platform("sign of all noise transfer functions of a vehicle", visible=False)
def _(folder, draw):
    return transfer(folder, draw, times(-1))


@on_platform("sign of one noise transfer function")
def _(folder, draw):
    vehicle = pick(draw, VEHICLES)
    one_of(folder / f"noise_transfer/{vehicle}.uff", draw, times(-1))
    return (vehicle,)


@on_platform("noise transfer functions as magnitudes")
def _(folder, draw):
    return transfer(folder, draw, lambda f: replace(f, values=np.abs(f.values) + 0j))


@on_platform("noise transfer functions in dB")
def _(folder, draw):
    level = lambda f: replace(f, values=20 * np.log10(np.abs(f.values) / 2e-5) + 0j)  # noqa: E731
    return transfer(folder, draw, level)


@on_platform("noise transfer functions over 20 uPa")
def _(folder, draw):
    return (*transfer(folder, draw, times(1 / 2e-5)), "noise transfer function")


@on_platform("noise transfer functions A-weighted")
def _(folder, draw):
    return transfer(folder, draw, lambda f: times(10 ** (a_weighting(f.abscissa) / 20))(f))


@on_platform("phase of noise transfer functions in degrees taken for radians")
def _(folder, draw):
    wrong = lambda f: np.abs(f.values) * np.exp(1j * np.angle(f.values, deg=True))  # noqa: E731
    return transfer(folder, draw, lambda f: replace(f, values=wrong(f)))


@on_platform("two vehicles from one file")
def _(folder, draw):
    first, second = two(draw, VEHICLES)
    nodes = {name: 901 + n for n, name in enumerate(VEHICLES)}
    text(
        folder / "platform.toml",
        rf'"noise_transfer/{first}\.uff"\near_node = {nodes[first]}',
        f'"noise_transfer/{second}.uff"\near_node = {nodes[second]}',
    )
    return (first, second)


@on_platform("content of another vehicle's file")
def _(folder, draw):
    first, second = two(draw, VEHICLES)
    target = folder / f"noise_transfer/{first}.uff"
    functions = read_uff(target)
    others = read_uff(folder / f"noise_transfer/{second}.uff")
    write_uff(target, [replace(a, values=b.values) for a, b in zip(functions, others, strict=True)])
    return (first, second)


@on_platform("ID line of another vehicle")
def _(folder, draw):
    first, second = two(draw, VEHICLES)
    target = folder / f"noise_transfer/{first}.uff"

    def change(f):
        return replace(f, id_lines=(f.id_lines[0].replace(first, second), *f.id_lines[1:]))

    functions(target, change)
    return (first, second)


@on_platform("two paths of a vehicle identical")
def _(folder, draw):
    vehicle, (first, second) = pick(draw, VEHICLES), draw.choice(10, 2, replace=False)
    path = folder / f"noise_transfer/{vehicle}.uff"
    functions = list(read_uff(path))
    functions[first] = replace(functions[first], values=functions[second].values)
    write_uff(path, functions)
    return (vehicle,)


@on_platform("two paths of a vehicle exchanged")
def _(folder, draw):
    vehicle, (first, second) = pick(draw, VEHICLES), draw.choice(10, 2, replace=False)
    path = folder / f"noise_transfer/{vehicle}.uff"
    functions = list(read_uff(path))
    values = functions[first].values, functions[second].values
    functions[first] = replace(functions[first], values=values[1])
    functions[second] = replace(functions[second], values=values[0])
    write_uff(path, functions)
    return (vehicle,)


@on_platform("microphone of another ear")
def _(folder, draw):
    return transfer(folder, draw, lambda f: replace(f, response_name="rear right"))


@on_platform("noise transfer functions 20 dB low")
def _(folder, draw):
    return transfer(folder, draw, times(0.1))


@on_platform("noise transfer functions per kN labelled N")
def _(folder, draw):
    return (*transfer(folder, draw, times(1e3)), "noise transfer function")


@on_platform("noise transfer function of one piece instead of both", visible=False)
def _(folder, draw):
    for vehicle in VEHICLES:
        functions(
            folder / f"noise_transfer/{vehicle}.uff",
            lambda f: times(0.5)(f) if f.reference_node == 110 else f,
        )
    return ("Du",)


@on_platform("lines of a noise transfer function file shifted")
def _(folder, draw):
    lines = int(draw.integers(1, 4))
    return transfer(folder, draw, lambda f: replace(f, abscissa=f.abscissa + 0.25 * lines))


# ---- platform: vehicles and names


def _entry(folder: Path, vehicle: str) -> str:
    blocks = (folder / "platform.toml").read_text().split("\n\n")
    return next(block for block in blocks if f'name = "{vehicle}"' in block)


@on_platform("a vehicle missing in the list")
def _(folder, draw):
    vehicle, path = pick(draw, VEHICLES), folder / "platform.toml"
    path.write_text(path.read_text().replace(_entry(folder, vehicle) + "\n\n", ""))
    return (vehicle,)


@on_platform("file of a vehicle missing")
def _(folder, draw):
    vehicle = pick(draw, VEHICLES)
    (folder / f"noise_transfer/{vehicle}.uff").unlink()
    return (vehicle,)


def _group(folder: Path, vehicle: str, group: str) -> Sequence[str]:
    path, entry = folder / "platform.toml", _entry(folder, vehicle)
    path.write_text(
        path.read_text().replace(entry, re.sub('group = ".*"', f'group = "{group}"', entry))
    )
    return (vehicle,)


@on_platform("a vehicle in another group")
def _(folder, draw):
    vehicle = pick(draw, VEHICLES)
    others = [name for name in ("U06", "F39", "F45") if not vehicle.startswith(name)]
    return _group(folder, vehicle, pick(draw, others))


@on_platform("a group in lower case")
def _(folder, draw):
    vehicle = pick(draw, VEHICLES)
    return (*_group(folder, vehicle, vehicle[:3].lower()), vehicle[:3])


for _name, _change in {
    "a name with a blank": lambda name: f"{name[:3]} {name[3:]}",
    "a name with a no-break space": lambda name: f"{name[:3]}\u00a0{name[3:]}",
    "a name that ends in a blank": lambda name: f"{name} ",
}.items():

    @on_platform(_name)
    def _(folder, draw, change=_change):
        vehicle = pick(draw, VEHICLES)
        text(folder / "platform.toml", f'name = "{vehicle}"', f'name = "{change(vehicle)}"')
        return (change(vehicle), vehicle, "name")


for _name, _change in {
    "a name beside its look-alike": lambda name: (
        name.replace("0", "O").replace("3", "З").replace("4", "Ꮞ")
    ),
    "a name beside its lower case": str.lower,
}.items():

    @on_platform(_name)
    def _(folder, draw, change=_change):
        first, second = VEHICLES[0], pick(draw, VEHICLES[1:5])
        text(folder / "platform.toml", f'name = "{second}"', f'name = "{change(first)}"')
        return (first, "name")


# ---- platform: frequency, order, engine


@on_platform("frequency of a file in rpm")
def _(folder, draw):
    case = pick(draw, CASES)
    functions(folder / f"operating/{case}.uff", lambda f: replace(f, abscissa=40 * f.abscissa))
    return (case, "frequency")


def _all_lines(folder: Path, factor: float) -> Sequence[str]:
    for path in sorted(folder.rglob("*.uff")):
        functions(path, lambda f: replace(f, abscissa=factor * f.abscissa))
    for path in sorted(folder.rglob("*_torque.csv")):
        rows = pd.read_csv(path)
        rows["frequency [Hz]"] *= factor
        rows.to_csv(path, index=False)
    return ("frequenc", "rpm", "order", "band", "lines")


def _order(folder: Path) -> float:
    return float(re.search(r"dominant_order = (\S+)", (folder / "platform.toml").read_text())[1])


@on_platform("all frequencies in rpm")
def _(folder, draw):
    return _all_lines(folder, 60 / _order(folder))


@on_platform("all frequencies in rad/s")
def _(folder, draw):
    return _all_lines(folder, 2 * np.pi)


@on_platform("frequency of the shaft, not of the order")
def _(folder, draw):
    return _all_lines(folder, 1 / _order(folder))


def _without_order(folder: Path) -> None:
    def change(f):
        return replace(f, id_lines=(re.sub(r"^order \S+ ", "", f.id_lines[0]), *f.id_lines[1:]))

    operating(folder, change)


@on_platform("half the order")
def _(folder, draw):
    return number(folder / "platform.toml", "dominant_order", lambda order: order / 2)


@on_platform("half the order, without an order in the files")
def _(folder, draw):
    _without_order(folder)
    return number(folder / "platform.toml", "dominant_order", lambda order: order / 2)


@on_platform("order of another engine, without an order in the files")
def _(folder, draw):
    _without_order(folder)
    return number(folder / "platform.toml", "dominant_order", {1.5: 2.0, 2.0: 1.5}.get)


@on_platform("cylinders of another engine")
def _(folder, draw):
    path = folder / "platform.toml"
    text(path, r"cylinders = (\d)", lambda m: f"cylinders = {7 - int(m[1])}")
    return ("cylinders",)


@on_platform("gear ratios reversed")
def _(folder, draw):
    return matrix(folder / "platform.toml", "total_ratios", lambda r: r[::-1])


@on_platform("gear ratios inverted")
def _(folder, draw):
    return matrix(folder / "platform.toml", "total_ratios", lambda r: 1 / r)


@on_platform("gear ratios without the final drive")
def _(folder, draw):
    return matrix(folder / "platform.toml", "total_ratios", lambda r: r / draw.uniform(3.4, 4.6))


@on_platform("torque limit in kN m")
def _(folder, draw):
    return number(folder / "platform.toml", "torque_limit_nm", lambda limit: limit / 1000)


# ---- platform: data sheet


@on_platform("mass in g")
def _(folder, draw):
    return (*number(folder / "platform.toml", "mass_kg", lambda mass: 1000 * mass), "mass")


@on_platform("mass in t")
def _(folder, draw):
    return (*number(folder / "platform.toml", "mass_kg", lambda mass: mass / 1000), "mass")


@on_platform("mass of the engine without its gearbox")
def _(folder, draw):
    share = draw.uniform(0.5, 0.7)
    return (*number(folder / "platform.toml", "mass_kg", lambda mass: share * mass), "mass")


@on_platform("inertia about another point")
def _(folder, draw):
    arm = np.array([draw.uniform(0.25, 0.5), draw.uniform(-0.2, 0.2), draw.uniform(0.2, 0.4)])
    moved = 190.0 * (arm @ arm * np.eye(3) - np.outer(arm, arm))
    return (*matrix(folder / "platform.toml", "inertia_kg_m2", lambda j: j + moved), "inertia")


@on_platform("sign of the products of inertia", visible=False)
def _(folder, draw):
    change = lambda j: 2 * np.diag(np.diag(j)) - j  # noqa: E731
    return (*matrix(folder / "platform.toml", "inertia_kg_m2", change), "inertia")


@on_platform("inertia in kg mm2")
def _(folder, draw):
    return (*matrix(folder / "platform.toml", "inertia_kg_m2", lambda j: 1e6 * j), "inertia")


@on_platform("inertia that violates the triangle inequality")
def _(folder, draw):
    n = int(draw.integers(3))
    change = lambda j: j + np.diag(np.eye(3)[n]) * 2.5 * np.trace(j)  # noqa: E731
    return (*matrix(folder / "platform.toml", "inertia_kg_m2", change), "inertia")


@on_platform("tolerance of the inertia in percent")
def _(folder, draw):
    percent = draw.integers(1, 6)
    return number(folder / "platform.toml", "inertia_tolerance", lambda _: float(percent))


@on_platform("tolerance of the inertia in kg mm2")
def _(folder, draw):
    size = 10 ** draw.uniform(2, 5)
    return number(folder / "platform.toml", "inertia_tolerance", lambda _: size)


@on_platform("tolerance of the mass above the mass")
def _(folder, draw):
    size = draw.uniform(200, 1000)
    return number(folder / "platform.toml", "mass_tolerance_kg", lambda _: size)


@on_platform("tolerance of the centre of gravity in mm")
def _(folder, draw):
    size = draw.uniform(1, 10)
    return number(folder / "platform.toml", "centre_of_gravity_tolerance_m", lambda _: size)


@on_platform("body mass missing")
def _(folder, draw):
    text(folder / "platform.toml", r"^body_mass.*\n", "")
    return ("Du", "body_mass")


@on_platform("body mass in t")
def _(folder, draw):
    path = folder / "platform.toml"
    number(path, "body_mass_tolerance_kg", lambda mass: mass / 1000)
    return number(path, "body_mass_kg", lambda mass: mass / 1000)


# ---- platform: tables


@on_platform("node of a force is that of another mount")
def _(folder, draw):
    first, second = draw.choice([101, 102, 103], 2, replace=False)
    swap = {str(first): str(second), str(second): str(first)}

    def change(rows):
        force = rows["quantity"] == "force"
        rows.loc[force, "node"] = rows.loc[force, "node"].map(lambda n: swap.get(n, n))

    table(folder / "channels.csv", change)
    return tuple(CARRIERS[int(n) - 101] for n in (first, second))


@on_platform("direction of a channel against its file")
def _(folder, draw):
    def change(rows):
        row = int(draw.integers(9))
        rows.loc[row, "direction"] = rows.loc[row, "direction"].replace("+", "-")

    table(folder / "channels.csv", change)
    return ("channels.csv", "direction", "displacement", "negative stiffness")


@on_platform("direction of a channel on another axis")
def _(folder, draw):
    def change(rows):
        row = int(draw.integers(len(rows)))
        turned = {"+x": "+y", "+y": "+z", "+z": "+x"}
        rows.loc[row, "direction"] = turned[rows.loc[row, "direction"]]

    table(folder / "channels.csv", change)
    return ("channels.csv",)


for _file in ("channels.csv", "mounts.csv"):

    @on_platform(f"a row twice in {_file}")
    def _(folder, draw, file=_file):
        double = lambda rows: pd.concat([rows, rows.sample(1, random_state=draw)])  # noqa: E731
        table(folder / file, double)
        return (file,)


for _name, _pattern, _new in (
    ("decimal commas in quotes", r"(-?\d)\.(\d+)", r'"\1,\2"'),
    ("thousands separators", r"(-?\d)\.(\d)(\d+)", r'"\1.\2.\3"'),
):

    @on_platform(_name)
    def _(folder, draw, pattern=_pattern, new=_new):
        text(folder / "mounts.csv", pattern, new)
        return ("mounts.csv",)


@on_platform("semicolons with decimal commas and points mixed")
def _(folder, draw):
    path = folder / "mounts.csv"
    lines = path.read_text().replace(",", ";").splitlines()
    n = int(draw.integers(1, len(lines)))
    lines[n] = lines[n].replace(".", ",")
    path.write_text("\n".join(lines) + "\n")
    return ("mounts.csv",)


@on_platform("a transfer axis forgotten")
def _(folder, draw):
    mount, path = pick(draw, CARRIERS), folder / "platform.toml"
    entry = _entry(folder, mount)
    path.write_text(path.read_text().replace(entry, entry.replace('["x", "y", "z"]', '["x", "y"]')))
    return (mount,)


# ---- compressor


def _lengths(factor: float, *sheets: str) -> Make:
    def make(folder, draw):
        for name in sheets:

            def change(rows):
                for axis in "xyz":
                    rows[f"{axis} [mm]"] *= factor

            sheet(folder / "positions.xlsx", name, change)
        return ("position", "density", "length")

    return make


on_compressor("positions in cm under a header in mm")(_lengths(0.1, "sensors", "impacts"))
on_compressor("sensors in cm, impacts in mm")(_lengths(0.1, "sensors"))
on_compressor("impacts in m under a header in mm")(_lengths(0.001, "impacts"))


@on_compressor("axes of a sensor swapped")
def _(folder, draw):
    node = 101 + int(draw.integers(6))
    first, second = two(draw, ("+x", "+y", "+z"))
    turned = {first: second, second: first}
    functions(
        folder / "frf.uff",
        lambda f: (
            replace(f, response_direction=turned.get(f.response_direction, f.response_direction))
            if f.response_node == node
            else f
        ),
    )
    return (f"A{node - 100}",)


@on_compressor("a channel reversed")
def _(folder, draw):
    node, axis = 101 + int(draw.integers(6)), pick(draw, ("+x", "+y", "+z"))
    functions(
        folder / "frf.uff",
        lambda f: times(-1)(f) if (f.response_node, f.response_direction) == (node, axis) else f,
    )
    return (f"A{node - 100}",)


@on_compressor("an impact reversed")
def _(folder, draw):
    node = 201 + int(draw.integers(18))
    functions(folder / "frf.uff", lambda f: times(-1)(f) if f.reference_node == node else f)
    return (f"I{node - 200:02}",)


@on_compressor("cables of two sensors exchanged")
def _(folder, draw):
    first, second = (101 + int(n) for n in draw.choice(6, 2, replace=False))
    swap = {first: second, second: first}
    functions(
        folder / "frf.uff",
        lambda f: replace(f, response_node=swap.get(f.response_node, f.response_node)),
    )
    return (f"A{first - 100}", f"A{second - 100}")


@on_compressor("functions of an impact identical with another's")
def _(folder, draw):
    first, second = (201 + int(n) for n in draw.choice(18, 2, replace=False))
    functions = read_uff(folder / "frf.uff")
    of = {
        (f.response_node, f.response_direction): f.values
        for f in functions
        if f.reference_node == second
    }
    write_uff(
        folder / "frf.uff",
        [
            replace(f, values=of[f.response_node, f.response_direction])
            if f.reference_node == first
            else f
            for f in functions
        ],
    )
    return (f"I{first - 200:02}", f"I{second - 200:02}")


def _all(change: Change, *words: str, file: str = "frf.uff") -> Make:
    def make(folder, draw):
        functions(folder / file, change)
        return words

    return make


on_compressor("acceleration in g labelled m/s2")(_all(times(1 / 9.80665), "scales", "weighed"))
on_compressor("force in lbf labelled N")(_all(times(4.448), "scales", "weighed"))
on_compressor("sensitivity of a charge amplifier off by 10")(_all(times(0.1), "scales", "weighed"))
on_compressor("functions conjugated")(
    _all(lambda f: replace(f, values=f.values.conj()), "conjugated")
)
on_compressor("mobility written as accelerance")(
    _all(lambda f: times(1 / jomega(f))(f), "mobility", "scales")
)
on_compressor("receptance written as accelerance")(
    _all(lambda f: times(1 / jomega(f) ** 2)(f), "receptance", "scales", "reversed")
)
on_compressor("hammer reversed")(_all(times(-1), "reversed"))


@on_compressor("weighed mass in g")
def _(folder, draw):
    path = folder / "compressor_test.toml"
    number(path, "weighed_mass_deviation_kg", lambda mass: 1000 * mass)
    return (*number(path, "weighed_mass_kg", lambda mass: 1000 * mass), "scales")


@on_compressor("drawn inertia in kg mm2")
def _(folder, draw):
    return matrix(folder / "compressor_test.toml", "inertia_kg_m2", lambda j: 1e6 * j)


@on_compressor("drawn mass in g")
def _(folder, draw):
    return (
        "drawing",
        *number(folder / "compressor_test.toml", "mass_kg", lambda mass: 1000 * mass),
    )


@on_compressor("drawn centre of gravity in mm")
def _(folder, draw):
    centre = draw.uniform(2, 15, 3) * draw.choice([-1, 1], 3)
    return matrix(folder / "compressor_test.toml", "centre_of_gravity_m", lambda _: centre)


@on_compressor("drawn rotation of the mounts in radians")
def _(folder, draw):
    return ("mount", *matrix(folder / "compressor_test.toml", "rotation_deg", np.deg2rad))


@on_compressor("drawn stiffness in N/mm")
def _(folder, draw):
    return (
        "mount",
        *matrix(folder / "compressor_test.toml", "stiffness_n_per_m", lambda k: k / 1e3),
    )


@on_compressor("drawn positions of the mounts in mm")
def _(folder, draw):
    return ("mount", *matrix(folder / "compressor_test.toml", "position_m", lambda p: 1e3 * p))


def _in_toml(file: str, key: str, change: Callable[[float], float]) -> Make:
    return lambda folder, draw: number(folder / file, key, change)


for _key in ("sensor_position_m", "impact_position_m"):
    on_compressor(f"{_key} in mm")(_in_toml("compressor_test.toml", _key, lambda t: 1e3 * t))
for _key in ("sensor_gain", "hammer_gain"):
    on_compressor(f"{_key} in percent")(_in_toml("compressor_test.toml", _key, lambda t: 1e2 * t))


@on_compressor("angles of the sensors in radians")
def _(folder, draw):
    def change(rows):
        for axis in ("rx", "ry", "rz"):
            rows[f"{axis} [deg]"] = np.deg2rad(rows[f"{axis} [deg]"].astype(float))

    sheet(folder / "positions.xlsx", "sensors", change)
    return ("angle", "[deg]", "radian", "turned", "orientation", "A1", "A2", "A3", "A4", "A5", "A6")


# ---- one vehicle


def _vehicle_uff(name: str, change: Change, *words: str) -> Make:
    return _all(change, *words, file=f"noise_transfer/{name}.uff")


on_vehicle("loudspeaker reversed")(_vehicle_uff("reciprocal", times(-1), "polarity", "reversed"))
on_vehicle("hammer's functions conjugated")(
    _vehicle_uff("direct", lambda f: replace(f, values=f.values.conj()), "conjugate")
)
on_vehicle("accelerance conjugated")(
    _vehicle_uff("accelerance", lambda f: replace(f, values=f.values.conj()), "conjugate")
)
on_vehicle("mobility as accelerance")(
    _vehicle_uff("accelerance", lambda f: times(1 / jomega(f))(f), "mobility")
)
on_vehicle("hammer's functions per kN labelled N")(
    _vehicle_uff("direct", times(1e3), "direct", "reciprocal", "factor")
)
on_vehicle("cylinders of another engine")(
    lambda folder, draw: (
        text(
            folder / "vehicle.toml", r"cylinders = (\d)", lambda m: f"cylinders = {7 - int(m[1])}"
        ),
        ("cylinders",),
    )[1]
)
on_vehicle("torque limit in kN m")(_in_toml("vehicle.toml", "torque_limit_nm", lambda t: t / 1e3))
on_vehicle("body mass in t")(
    lambda folder, draw: (
        *number(folder / "vehicle.toml", "body_mass_kg", lambda mass: mass / 1e3),
        "body mass",
    )
)
on_vehicle("gear ratios inverted")(
    lambda folder, draw: matrix(folder / "vehicle.toml", "total_ratios", lambda r: 1 / r)
)
on_vehicle("positions of the mounts in cm under m")(
    lambda folder, draw: places(folder / "mounts.csv", lambda p: 100 * p)
)


# ---- campaign


def _in_campaign(name: str, key: str, factor: float) -> None:
    on_campaign(name)(_in_toml("campaign.toml", key, lambda value: factor * value))


_in_campaign("mass in g", "mass_kg", 1e3)
_in_campaign("mass in t", "mass_kg", 1e-3)
_in_campaign("tolerance of places in mm", "sensor_position_m", 1e3)
_in_campaign("tolerance of angles in degrees", "sensor_angle_rad", 180 / np.pi)
_in_campaign("tolerance of gains in percent", "sensor_gain", 1e2)
_in_campaign("torque in kN m", "torque_nm", 1e-3)
on_campaign("inertia in kg mm2")(
    lambda folder, draw: matrix(folder / "campaign.toml", "inertia_kg_m2", lambda j: 1e6 * j)
)
on_campaign("gear ratios reversed")(
    lambda folder, draw: matrix(folder / "campaign.toml", "total_ratios", lambda r: r[::-1])
)
on_campaign("two runs from one file")(
    lambda folder, draw: (
        text(folder / "campaign.toml", r'"runs/M1/g5_wot120.uff"', '"runs/M1/g5_wot220.uff"'),
        ("g5_wot120", "g5_wot220"),
    )[1]
)
on_campaign("half the order, without an order in the files")(
    lambda folder, draw: (
        [
            functions(
                path,
                lambda f: replace(
                    f, id_lines=tuple(re.sub(r"order [\d.]+", "", line) for line in f.id_lines)
                ),
            )
            for path in sorted(folder.rglob("*.uff"))
        ],
        number(folder / "campaign.toml", "dominant_order", lambda order: order / 2),
    )[1]
)


# ---- operation

on_operation("pressure in kPa")(_in_toml("operation.toml", "pressure_bar", lambda p: 100 * p))
on_operation("rotor inertia in kg mm2")(
    _in_toml("operation.toml", "rotor_inertia_kg_m2", lambda j: 1e6 * j)
)
on_operation("length of hoses in mm")(_in_toml("operation.toml", "length_m", lambda n: 1e3 * n))
on_operation("line mass of hoses in g/m")(
    _in_toml("operation.toml", "line_mass_kg_per_m", lambda m: 1e3 * m)
)


@on_operation("two sweeps from one file")
def _(folder, draw):
    text(folder / "operation.toml", r"sweeps/soft_7.5_bar.uff", "sweeps/soft_13.5_bar.uff")
    return ("soft 7.5 bar", "soft 13.5 bar", "soft_13.5_bar")


# ---- building and judging

RUNS_ON_BENCH = tuple(
    PlannedRun(*run, full_load=True) for run in ((5, 120.0), (5, 220.0), (6, 220.0))
)


SHORT_RUN = TimeRunPlan(last_speed=1800.0, duration=3.0)
"""A run over time that is soon tracked."""


def drawn_family(kind: FolderKind, seed: int) -> str:
    """Return the family of a right folder: bodies by turns, rubber and laboratory drawn."""
    if kind is FolderKind.campaign:  # no body, and rubber as tested
        return "payne,noise"
    bodies = (BRACKETS, *KINDS)
    return f"{bodies[seed % len(bodies)]},{','.join(FACTORS)}"


def _write_right(kind: FolderKind, folder: Path, seed: int) -> None:
    """Write a folder without a mistake, of a family that is drawn.

    The bench has no families of compressors and components: their bodies are drawn, rubber may
    soften with its amplitude, and laboratories calibrate by turns well and badly.
    """
    level = list(CalibrationLevel)[seed % len(CalibrationLevel)]
    if kind is FolderKind.platform:
        write_platform(folder, seed, truth_seed=seed, family=drawn_family(kind, seed))
    elif kind is FolderKind.campaign:
        over_time = None if seed % 4 else SHORT_RUN
        plan = CampaignPlan(("M1",), RUNS_ON_BENCH, 1, over_time)
        family = draw_family(drawn_family(kind, seed), seed, seed)
        write_campaign(folder, seed, plan, bench=load_bench(seed), family=family)
    elif kind is FolderKind.compressor:
        plan = CompressorPlan(identical_mounts=seed % 3 == 0, softening=seed % 2 == 0)
        write_compressor_test(folder, seed, level, plan)
    elif kind is FolderKind.component:
        write_component_test(folder, seed, level, truth_seed=seed)
    else:
        _write(kind, folder, seed)


def _write(kind: FolderKind, folder: Path, seed: int) -> None:
    if kind is FolderKind.platform:
        write_platform(folder, seed, truth_seed=seed)
    elif kind is FolderKind.compressor:
        write_compressor_test(folder, seed)
    elif kind is FolderKind.vehicle:
        write_vehicle(folder, seed, truth_seed=seed)
    elif kind is FolderKind.campaign:
        write_campaign(folder, seed, CampaignPlan(("M1",), RUNS_ON_BENCH, 1))
    elif kind is FolderKind.operation:
        write_operating_test(folder, seed)
    elif kind is FolderKind.component:
        write_component_test(folder, seed, truth_seed=seed)


@dataclass(frozen=True)
class Outcome:
    """What ``deboom check`` made of a mistake.

    - `sentences`: faults, WARNINGs and ALARMs that the folder does not have without the mistake.
    - `words`: of which one must be in them.
    """

    mistake: Mistake
    seed: int
    sentences: tuple[str, ...]
    words: tuple[str, ...]

    @property
    def named(self) -> bool:
        """Whether a sentence tells where the mistake is."""
        return any(word in sentence for word in self.words for sentence in self.sentences)


def findings(folder: Path) -> tuple[str, ...]:
    """Return faults, WARNINGs and ALARMs of ``deboom check``."""
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always", DataWarning)
        faults, _, summary = check_folder(folder)
    lines = [line for line in summary.splitlines() if "WARNING" in line or "ALARM" in line]
    return tuple(
        sentence.replace(str(folder), "")
        for sentence in (*faults, *lines, *(str(finding.message) for finding in caught))
    )


def outcomes(seed: int, wanted: Sequence[Mistake] = ()) -> Iterator[Outcome]:
    """Build mistakes on folders of a seed, and check them."""
    with tempfile.TemporaryDirectory(prefix="deboom-") as temporary:

        @cache
        def right(kind: FolderKind) -> tuple[Path, tuple[str, ...]]:
            folder = Path(temporary) / kind.value
            _write(kind, folder, seed)
            shutil.rmtree(folder / "truth", ignore_errors=True)
            return folder, findings(folder)

        for place, mistake in enumerate(MISTAKES):
            if wanted and mistake not in wanted:
                continue
            source, before = right(mistake.folder)
            folder = Path(shutil.copytree(source, Path(temporary) / "wrong"))
            words = mistake.make(folder, np.random.default_rng([seed, place]))
            sentences = tuple(text for text in findings(folder) if text not in before)
            shutil.rmtree(folder)
            yield Outcome(mistake, seed, sentences, tuple(words))


def alarms(kind: FolderKind, seed: int) -> tuple[str, ...]:
    """Return what ``deboom check`` says against a folder without a mistake."""
    with tempfile.TemporaryDirectory(prefix="deboom-") as temporary:
        folder = Path(temporary) / kind.value
        _write_right(kind, folder, seed)
        return findings(folder)


def main(mistakes: Sequence[Mistake]) -> None:
    """Print each mistake with how often it was named."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawTextHelpFormatter
    )
    parser.add_argument("--seeds", type=int, nargs="*", default=[])
    parser.add_argument("--folder", choices=[kind.value for kind in FolderKind])
    parser.add_argument("--right", choices=[kind.value for kind in FolderKind])
    parser.add_argument("--sentences", action="store_true", help="show what was said")
    options = parser.parse_args()
    warnings.simplefilter("ignore", AxisDriftWarning)
    if options.right:
        for seed in options.seeds:
            print(seed, *alarms(FolderKind(options.right), seed) or ["nothing"], sep="\n  ")
        return
    wanted = [m for m in mistakes if options.folder in (None, m.folder.value)]
    table: dict[Mistake, list[bool]] = defaultdict(list)
    for seed in options.seeds:
        for each in outcomes(seed, wanted):
            table[each.mistake].append(each.named)
            if options.sentences:
                print(
                    f"{'+' if each.named else '-'} {each.mistake.folder.value}: {each.mistake.name}"
                )
                print(*(f"      {text[:300]}" for text in each.sentences), sep="\n")
    for mistake, named in table.items():
        hidden = "  (harmless)" if mistake.harmless else "  (cannot be seen)"
        seen = "" if mistake.visible else hidden
        print(f"{sum(named)}/{len(named)}  {mistake.folder.value}: {mistake.name}{seen}")
    visible = [hit for mistake, named in table.items() if mistake.visible for hit in named]
    print(f"named: {sum(visible)} of {len(visible)}, {100 * np.mean(visible):.1f} %")


if __name__ == "__main__":
    with suppress(KeyboardInterrupt):
        main(MISTAKES)
