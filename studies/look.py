"""Show what is in a folder: functions, coherence, orders, waterfall and geometry on one page.

FOLDER may be of any kind that `deboom new` writes. Nothing is identified and nothing is corrected:
the page shows the measured data and the result of `deboom check`. Contradictions in the numbers are
warnings on the page. Files that cannot be read, or that do not fit together, are refused as by
`deboom check`.

Try: deboom bench compressor test, then deboom look test
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

from typer import Argument

from deboom.pages.look import look_report
from deboom.report import Report

QUESTION = "What is in this folder, and does it look right?"


@dataclass(frozen=True)
class Options:
    """Which folder is shown."""

    folder: Annotated[Path, Argument(help="Folder of any kind that `deboom new` writes.")]


def prepare(options: Options) -> Path:
    """Take the folder as it is."""
    return options.folder


def run(folder: Path, options: Options) -> Report:
    """Read the folder and draw it."""
    del options
    return look_report(folder)
