"""Speed of the hot parts against plain code, as ratios measured side by side in one process.

Each module in `TABLES` has a docstring, whose first line is its title, and a ``report() -> str``.
The times are quiet ones (10th percentile of interleaved calls). Ratios carry over to other
machines; microseconds do not.
"""

from __future__ import annotations

import platform
from types import ModuleType

import numpy as np

import default_runs
import end_to_end
import kernels
import live_page
import two_workers

TABLES: tuple[ModuleType, ...] = (
    kernels,
    end_to_end,
    live_page,
    two_workers,
    default_runs,
)


def main() -> None:
    print(f"Python {platform.python_version()}, numpy {np.__version__}, {platform.machine()}")
    for module in TABLES:
        title, _, rest = (module.__doc__ or module.__name__).partition("\n")
        print(f"\n{title}\n{rest.strip()}\n")
        print(module.report())


if __name__ == "__main__":
    main()
