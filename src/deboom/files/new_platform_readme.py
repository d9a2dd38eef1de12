"""The README of a new platform folder: each file, and what must be put where."""

from __future__ import annotations

from collections.abc import Sequence

from deboom.files.function_files import FunctionFiles

_TABLE = """\
First sheet (xlsx) or file (CSV): one row per line, the column `frequency [Hz]`, and two columns per
function, `NAME real [unit]` and `NAME imag [unit]`. Other columns are passed over.

| file | NAME | unit | example |
|---|---|---|---|
| noise_transfer | `mount axis` | Pa/N or Pa/kN | `{mount} x real [Pa/N]` |
| operating | `mount piece axis quantity` | m, mm, um or N, kN | `{mount} x force imag [N]` |
"""
_MAT = """\
MATLAB, saved with `save(file, ..., '-v7')`; version 7.3 is not read. Variables:

| variable | size | what |
|---|---|---|
| `frequency` | n | lines [Hz] |
| `names` | k, cell array of text | noise_transfer: `{mount} x`; operating: `{mount} x force` |
| `values` | n × k, complex | one column per name |
| `units` | one text, or k | such as `Pa/N`, `mm`, `kN` |
"""
_UFF = """\
UFF data set 58 with a unit label, or with data set 164. Functions are found by node and direction:

| file | type | response | reference | quantity |
|---|---|---|---|---|
| noise_transfer | 4 (FRF) | `ear_node` of platform.toml, scalar | node and direction of the path \
| pressure Pa over force N |
| operating | 0, 12 or 27, complex | node and direction of the channel | none | displacement m, \
force N |

Which node and direction is which channel stands in `channels.xlsx`: change the numbers there to
those of your files. A first ID line `order 1.5 ...` is held against `dominant_order`.
"""


def readme_text(
    name: str,
    group: str,
    transfer: Sequence[tuple[str, str]],
    operating: Sequence[tuple[str, str]],
    files: FunctionFiles,
) -> str:
    """Return ``README.md``.

    Parameters
    ----------
    name : str
        Of the folder.
    group : str
        Of the vehicles.
    transfer, operating : sequence of (str, str)
        Files of noise transfer functions with their vehicle, and of operating spectra with their
        load case.
    files : FunctionFiles
        Their format.
    """
    header_only = files in (FunctionFiles.csv, FunctionFiles.xlsx)
    state = "there, with its columns: add the lines" if header_only else "put it here"
    rows = [
        ("platform.toml", "engine, powertrain, names", "keys marked FILL IN"),
        ("mounts.xlsx", "where each mount sits", "x, y, z of each row"),
        (
            "channels.xlsx",
            "which channel is what, and its unit",
            "unit, and for UFF node and direction",
        ),
        *((file, f"noise transfer functions of {vehicle}", state) for file, vehicle in transfer),
        *((file, f"displacement and force in {case}", state) for file, case in operating),
    ]
    table = [f"| `{file}` | {what} | {todo} |" for file, what, todo in rows]
    formats = {
        FunctionFiles.uff: _UFF,
        FunctionFiles.csv: _TABLE,
        FunctionFiles.xlsx: _TABLE,
        FunctionFiles.mat: _MAT,
    }
    others = {
        FunctionFiles.uff: "a table (CSV, xlsx) or MATLAB file",
        FunctionFiles.csv: "a UFF, xlsx or MATLAB file",
        FunctionFiles.xlsx: "a UFF, CSV or MATLAB file",
        FunctionFiles.mat: "a UFF, CSV or xlsx file",
    }
    return "\n".join(
        [
            f"# {name}",
            "",
            "A platform for deboom: fill in the files below, in this order, and run",
            "",
            f"    deboom check {name}",
            "",
            "It lists everything that is missing or wrong, each with its remedy, until nothing is.",
            "Then:",
            "",
            f"    deboom run studies/u06_robust_front.py --platform {name} --group {group} "
            "--mounts spectra",
            "",
            "| file | what | to do |",
            "|---|---|---|",
            *table,
            "",
            "`channels.xlsx` and `mounts.xlsx`: the first sheet is read; the second one explains",
            "its columns. Rows of an axis that was not measured go out, and the axis out of",
            "`transfer_axes` in `platform.toml`.",
            "",
            "## What must be measured",
            "",
            "- **Operating spectra**: displacement of the powertrain relative to the body, and",
            "  force on the body, at every mount; complex **peak** amplitudes along the dominant",
            "  engine order, phase referred to the tacho, time factor e^(+jwt).",
            "- **Noise transfer functions**: pressure at the driver's ear per force on the body,",
            "  complex. For a mount of several pieces: the same force on all of them in phase, per",
            "  newton of their sum.",
            "- All of them on the **same frequency lines**; studies sum over 20 to 60 Hz.",
            "- Axes: x rearward, y to the right, z up; a force acts on the body.",
            "",
            f"## Format: {files.value}",
            "",
            formats[files].format(mount="TSM"),
            f"A single file may as well be {others[files]}: name it in `platform.toml`;",
            "its ending tells how it is read. deboom's guide `docs/guides/your-own-platform.md`",
            "shows all of them, and the way to the first front.",
        ]
    ) + "\n"  # fmt: skip
