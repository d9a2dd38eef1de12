"""Process that reads MDF, TDMS, HDF5 and MATLAB files, so that a file cannot reach deboom itself.

It reads the files of one folder, one after another, and ends with the folder: starting it takes
longer than reading most files. It starts with ``-P`` and without ``PYTHONPATH`` in an empty folder,
so that no file beside the one that is read is ever imported.
"""

from __future__ import annotations

import atexit
import contextlib
import importlib.util
import json
import math
import os
import signal
import subprocess
import sys
import tempfile
import threading
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from deboom.errors import InputError, naming
from deboom.files import binary_formats
from deboom.files.binary_formats import LIBRARIES, LONGEST_READING, MATLAB, MATLAB_73
from deboom.files.disk import LARGEST_MEMORY, MEBIBYTE

LONGEST_WAIT = 10 * LONGEST_READING
"""The same by the clock: other work on the machine is no fault of a file [s]."""
_AGAIN = {
    MATLAB: "is damaged, or no MATLAB file: save it again with save(file, ..., '-v7')",
    MATLAB_73: "is a damaged MATLAB file of version 7.3: save it again",
}


class _Reader:
    """Running process, which reads the files of `source`."""

    def __init__(self, source: Path) -> None:
        self.source, self.owner, self.is_late = source, os.getpid(), False
        self.folder = tempfile.TemporaryDirectory(prefix="deboom-", ignore_cleanup_errors=True)
        self.errors = tempfile.TemporaryFile()  # noqa: SIM115
        # -P keeps the folder that a process runs in off its path, and entries of PYTHONPATH may be
        # relative; what `pip install --user` installed is still found
        kept = {name: text for name, text in os.environ.items() if name != "PYTHONPATH"}
        temporary = dict.fromkeys(("TMPDIR", "TEMP", "TMP"), self.folder.name)
        threads = dict.fromkeys(("OPENBLAS_NUM_THREADS", "NUMEXPR_MAX_THREADS"), "1")
        self.process = subprocess.Popen(
            [sys.executable, "-P", "-m", binary_formats.__name__],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=self.errors,
            cwd=self.folder.name,
            env=kept | temporary | threads,
        )

    def ask(self, *task: object) -> dict[str, Any] | None:
        """Return the answer to a task; None where the process ended instead."""
        assert self.process.stdin is not None
        assert self.process.stdout is not None
        clock = threading.Timer(LONGEST_WAIT, self._stop)
        clock.start()
        try:
            self.process.stdin.write(json.dumps(task).encode() + b"\n")
            self.process.stdin.flush()
            line = self.process.stdout.readline()
        except OSError:
            line = b""
        finally:
            clock.cancel()
        answer: dict[str, Any] | None = json.loads(line) if line.endswith(b"\n") else None
        return answer

    def _stop(self) -> None:
        self.is_late = True
        self.process.kill()

    def end(self) -> dict[str, str]:
        """End the process; return as an answer why it gave none."""
        with contextlib.suppress(OSError):
            self.process.communicate()  # it ends when its input does
        self.errors.seek(0)
        told = self.errors.read().decode(errors="replace").strip()
        self.errors.close()
        self.folder.cleanup()
        if "No module named" in told:
            return {"lacks": told.splitlines()[-1]}
        ran_out = self.process.returncode == -getattr(signal, "SIGXCPU", math.inf)
        return {"fault": "time" if self.is_late or ran_out else "damage"}


_lock = threading.Lock()
_readers: list[_Reader] = []
"""The one that runs, if any."""


@atexit.register
def _end() -> None:
    while _readers:
        reader = _readers.pop()
        if reader.owner == os.getpid():  # else it serves the process that this one was forked from
            reader.end()


def read_apart(
    path: Path, kind: str, names: Sequence[str]
) -> tuple[dict[str, Any], list[npt.NDArray[Any]]]:
    """Read a file in a process of its own, within limits of memory and time.

    - `path`: the file.
    - `kind`: one of `LIBRARIES`.
    - `names`: of the channels that are read; of a MATLAB file the variable of the lines.
    - returns: what the process answers, and the arrays of the file.
    - raises InputError: the file is damaged or takes too much memory or time; the library is not
      installed; what the process refuses.
    """
    module, extra = LIBRARIES[kind]
    if extra and importlib.util.find_spec(module) is None:
        raise InputError(f"{path} needs {module} to be read: pip install 'deboom[{extra}]'")
    source = path.resolve()
    with _lock:
        reader = _reader_of(source.parent)
        answer = None
        try:
            answer = reader.ask(str(source), kind, list(names))
            if answer is not None:
                _readers.append(reader)
                _refuse(path, kind, answer)
                return answer, [_array(reader, number) for number in range(answer["arrays"])]
        finally:
            if answer is None:
                reader.process.kill()
            for written in Path(reader.folder.name).glob("*.npy"):
                written.unlink()
    reason = reader.end()
    _refuse(path, kind, reason)
    raise AssertionError(reason)


def _reader_of(source: Path) -> _Reader:
    """Take the process that reads the files of a folder, or start it."""
    readers = [each for each in _readers if (each.source, each.owner) == (source, os.getpid())]
    if readers and readers[0].process.poll() is None:
        return _readers.pop()
    _end()
    return _Reader(source)


def _array(reader: _Reader, number: int) -> npt.NDArray[Any]:
    # Windows deletes no file that is mapped
    mode: Any = "c" if os.name == "posix" else None
    path = Path(reader.folder.name) / f"{number}.npy"
    return np.asarray(np.load(path, mmap_mode=mode, allow_pickle=False))


def _refuse(path: Path, kind: str, answer: dict[str, Any]) -> None:
    """Raise what an answer says instead of the content of a file."""
    if "lacks" in answer:
        raise InputError(
            f"{path}: such files are read by a process without PYTHONPATH, which lacks a package "
            f"({answer['lacks']}): install deboom and its libraries for {sys.executable}"
        )
    if "refused" in answer:
        with naming(path):
            raise InputError(answer["refused"])
    fault = {
        "memory": f"needs more than {LARGEST_MEMORY / MEBIBYTE:.0f} MiB of memory: save fewer "
        "channels or samples",
        "time": f"takes more than {LONGEST_READING} s to read: save fewer channels or samples",
        "disk": f"does not fit into {tempfile.gettempdir()}: make room there",
        "damage": _AGAIN.get(kind, f"is {kind}, but damaged: export it again"),
    }
    if "fault" in answer:
        raise InputError(f"{path} {fault[answer['fault']]}")
