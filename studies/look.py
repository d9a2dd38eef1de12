"""Show what is in a folder or in files: functions, coherence, orders and geometry on one page.

SOURCE may be a folder of any kind that `deboom new` writes. Nothing is identified and nothing is
corrected: the page shows the measured data and the result of `deboom check`. Contradictions in the
numbers are warnings on the page. Files that cannot be read, or that do not fit together, are
refused as by `deboom check`.

SOURCE may also be files, of any format that deboom reads: functions of one name lie over each
other, pairs with response and reference exchanged are compared, and signals over time become
third octaves and, with `--tacho`, a Campbell diagram and cuts of all orders. Recordings in Pa get
their loudness and roughness, with `pip install 'deboom[sound-quality]'`.

Try: deboom bench compressor test, then deboom look test
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

from typer import Argument, Option

from deboom.errors import InputError
from deboom.files.platform import platform_folder
from deboom.pages.look import look_report
from deboom.pages.look_files import look_files_report
from deboom.report import Report

QUESTION = "What is in this folder or in these files, and does it look right?"


@dataclass(frozen=True)
class Options:
    """What is shown."""

    source: Annotated[
        list[Path],
        Argument(help="Folder of any kind that `deboom new` writes, u06, or files."),
    ]
    tacho: Annotated[
        str, Option(help="Channel of the files that gives the speed: pulses, or 1/min.")
    ] = ""
    pulses: Annotated[
        int, Option(min=1, help="Pulses of the tacho per revolution, missing teeth included.")
    ] = 1


def prepare(options: Options) -> list[Path]:
    """Take one folder, or files."""
    sources = [platform_folder(path) for path in options.source]
    folders = [path for path in sources if path.is_dir()]
    if folders and len(sources) > 1:
        raise InputError(f"{folders[0]} is a folder: look at one folder, or at files")
    if folders and options.tacho:
        raise InputError(f"--tacho is for files; the runs of {folders[0]} state theirs")
    return sources


def run(sources: list[Path], options: Options) -> Report:
    """Read the folder or the files and draw them."""
    if sources[0].is_dir():
        return look_report(sources[0])
    return look_files_report(sources, options.tacho, options.pulses)
