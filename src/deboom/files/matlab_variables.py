"""Read a MATLAB file of version 5 to 7.2; runs in a process of its own, see `function_table`.

SciPy's compiled reader may crash on a damaged file. The process starts with ``-P`` and without
``PYTHONPATH`` in an empty folder, so that no file beside the one that is read is ever imported.
"""

from __future__ import annotations

import importlib
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

VARIABLES = ("frequency", "time", "names", "values", "units")
"""Variables that are read; others in the file are left alone."""
STRUCTURES = "structures"
"""Array of the names of the structures in the file, which are not read."""
NO_SCIPY, TOO_LARGE = 3, 4
"""Exit status of a process that does not find SciPy, or whose memory does not suffice."""


def main(arguments: Sequence[str]) -> int:
    """Write the variables of a MATLAB file as npz; `arguments`: file, npz, memory in bytes."""
    source, target, memory = arguments
    try:
        import numpy as np
        from scipy.io import loadmat, whosmat
    except ImportError as error:
        print(error, file=sys.stderr)
        return NO_SCIPY
    _limit_memory(int(memory))
    try:
        content = loadmat(
            source, squeeze_me=True, chars_as_strings=True, variable_names=list(VARIABLES)
        )
        structures = [name for name, _, kind in whosmat(source) if kind == "struct"]
        arrays: dict[str, Any] = {STRUCTURES: np.array(structures, dtype=str)}
        for name in VARIABLES:
            if name not in content:
                continue
            value = content[name]
            if name in ("names", "units"):
                arrays[name] = np.array([str(text) for text in np.ravel(value)])
            elif np.asarray(value).dtype.kind in "biufc":
                arrays[name] = value
            else:
                arrays[name] = np.array(str(value))
        np.savez(target, allow_pickle=False, **arrays)
    except MemoryError:
        return TOO_LARGE
    return 0


def _limit_memory(size: int) -> None:
    """Let the process take so much more memory; Windows knows no such limit."""
    try:
        resource = importlib.import_module("resource")
        pages = int(Path("/proc/self/statm").read_text(encoding="ascii").split()[0])
    except (ImportError, OSError):
        return
    wanted = pages * resource.getpagesize() + size
    _, most = resource.getrlimit(resource.RLIMIT_AS)
    if most == resource.RLIM_INFINITY or wanted < most:
        resource.setrlimit(resource.RLIMIT_AS, (wanted, most))


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
