"""Reading and writing: files are read whole within limits, and appear complete or not at all."""

from __future__ import annotations

import io
import json
import math
import os
import shutil
import stat
import tempfile
import zlib
from collections.abc import Iterator
from contextlib import contextmanager
from io import BufferedReader
from pathlib import Path
from typing import IO, Any, NoReturn
from zipfile import BadZipFile, ZipFile

import numpy as np
import numpy.typing as npt

from deboom.errors import InputError

MEBIBYTE = 2**20
LARGEST_FILE = 1024 * MEBIBYTE
"""Largest file of measurements that is read; larger ones would fill the memory [bytes]."""
LARGEST_TEXT = 64 * MEBIBYTE
"""The same for text of facts and tables [bytes]."""
LARGEST_MEMORY = 2048 * MEBIBYTE
"""What reading one file may take [bytes]."""
MOST_NUMBERS = (LARGEST_MEMORY - 128 * MEBIBYTE) // 8
"""Numbers that all channels of a file may announce that are read; a small file may announce any."""
MOST_PARTS = 10_000
"""Files that a zip archive, such as a workbook, may hold."""


def read_bytes(path: Path, largest: int = LARGEST_FILE) -> bytes:
    """Return the content of a regular file.

    - `path`: the file; devices and pipes are refused, because they may never end.
    - `largest`: largest size that is read [bytes].
    - raises InputError: the file is missing, no regular file, too large or not readable.
    """
    with opened_file(path, largest) as file:
        return file.read()


@contextmanager
def opened_file(path: Path, largest: float = math.inf) -> Iterator[BufferedReader]:
    """Open a regular file to be read.

    - `path`: the file; devices and pipes are refused, because they may never end.
    - `largest`: largest size that is opened [bytes].
    - raises InputError: the file is missing, no regular file, too large or not readable.
    """
    try:
        mode = path.stat().st_mode
        if not (stat.S_ISREG(mode) or stat.S_ISDIR(mode)):
            raise InputError(f"{path} is a device or a pipe: name a file on disk")
        with path.open("rb") as file:
            size = os.fstat(file.fileno()).st_size
            if size > largest:
                raise InputError(
                    f"{path} has {size / MEBIBYTE:.0f} MiB, at most "
                    f"{largest / MEBIBYTE:.0f} MiB are read: check that it is the right file"
                )
            yield file
    except OSError as error:
        raise InputError(f"{path} cannot be read ({error.strerror}): check the path") from None
    except ValueError as error:
        if isinstance(error, InputError):
            raise
        raise InputError(f"{str(path)!r} is no name of a file: check the path") from None


def refuse_announced(what: str, count: int) -> None:
    """Refuse more numbers than are read, before memory is taken for them.

    - `what`: file and item.
    - raises InputError: `count` is too large.
    """
    if count > MOST_NUMBERS:
        raise InputError(
            f"{what} announces {count} numbers, at most {MOST_NUMBERS} are read: export it again, "
            "with fewer samples"
        )


BLOCK = 2**20
"""Numbers of a long array that are worked on at once."""


def blocks(size: int) -> Iterator[slice]:
    """Yield the parts of a long array, one after another, so that what is computed stays small."""
    return (slice(start, min(start + BLOCK, size)) for start in range(0, size, BLOCK))


_KINDS = (
    (b"MDF     ", "an MDF file"),
    (b"UnFinMF ", "an MDF file that its logger did not finish"),
    (b"TDSm", "a TDMS file"),
    (b"MATLAB ", "a MATLAB file"),
    (b"\x89HDF", "an HDF5 file"),
    (b"LabVIEW Measurement", "a LabVIEW measurement file"),
    (b"RIFF", "a WAV file"),
    (b"RF64", "a WAV file"),
    (b"    -1", "a UFF file"),
    (b"PK\x03\x04", "a workbook or another zip archive"),
    (b"\xd0\xcf\x11\xe0", "an old workbook (.xls)"),
    (b"\x1f\x8b", "a gzip archive"),
    (b"|CF,", "an imc FAMOS file"),
    (b"<?xml", "an XML file"),
)
"""First bytes of a file → what it is."""
_UTF_16 = b"\xff\xfe", b"\xfe\xff"


def kind_of(path: Path) -> str:
    """Tell what a file is by its first bytes, such as ``an MDF file``; its ending may be wrong.

    - raises InputError: as `read_bytes`, or the file is empty.
    """
    with opened_file(path, LARGEST_FILE) as file:
        data = file.read(512)
    start = data.removeprefix(b"\xef\xbb\xbf").lstrip(b"\r\n")
    if not start.strip():
        raise InputError(f"{path} is empty: export it again")
    for first, kind in _KINDS:
        if start.startswith(first):
            return kind
    code = "utf-16" if data.startswith(_UTF_16) else "utf-8"
    line = " ".join(start.decode(code, errors="replace").partition("\n")[0].split())[:40]
    return f"text that begins with '{line}'" if line.isprintable() else "of an unknown binary kind"


def text_of(path: Path, largest: int = LARGEST_TEXT) -> str:
    """Return the text of a regular file of another program, see `read_bytes`.

    It is UTF-8, UTF-16 with its mark, or else Windows' code page 1252, as measuring programs write.
    A name or unit of another code page becomes one that is not known, and is refused as such.

    - raises InputError: as `read_bytes`.
    """
    data = read_bytes(path, largest)
    if data.startswith(_UTF_16):
        return data.decode("utf-16", errors="replace")
    return decoded(data)


def decoded(data: bytes) -> str:
    """Return a text that is UTF-8, or else in Windows' code page 1252."""
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError:
        return data.decode("cp1252", errors="replace")


def read_text(path: Path, largest: int = LARGEST_TEXT) -> str:
    """Return the UTF-8 text of a regular file, see `read_bytes`.

    - raises InputError: as `read_bytes`, or the file is no UTF-8 text.
    """
    try:
        return read_bytes(path, largest).decode("utf-8")
    except UnicodeDecodeError:
        raise InputError(f"{path} is not UTF-8 text: save it as UTF-8") from None


def read_json(path: Path, remedy: str) -> dict[str, Any]:
    """Return the object that a JSON file holds.

    - `path`: the file.
    - `remedy`: advice for the error, such as ``export it again``.
    - raises InputError: the file cannot be read, is no JSON object, is nested too deeply or holds
      NaN.
    """

    def refuse(constant: str) -> NoReturn:
        raise ValueError(f"{constant} is no number")

    try:
        content = json.loads(read_text(path), parse_constant=refuse)
    except InputError:
        raise
    except RecursionError:
        raise InputError(f"{path} is nested too deeply for JSON of deboom: {remedy}") from None
    except ValueError as error:
        raise InputError(f"{path} is not JSON ({error}): {remedy}") from None
    if not isinstance(content, dict):
        raise InputError(f"{path} holds no JSON object: {remedy}")
    return content


def read_document(path: Path, form: str, version: int, kind: str, remedy: str) -> dict[str, Any]:
    """Return the entries of a JSON document that states its format and version.

    - `path`: the file.
    - `form`, `version`: the format and the version that are read.
    - `kind`: end of the sentence ``<path> is no …`` for a file of another format.
    - `remedy`: advice for the error.
    - raises InputError: as `read_json`, or another format or version.
    """
    document = read_json(path, remedy)
    if document.pop("format", None) != form:
        raise InputError(f"{path} is no {kind}")
    stated = document.pop("version", None)
    if stated != version or isinstance(stated, bool):
        raise InputError(
            f"{path} has version {str(stated)[:40]} of the format, this deboom reads version "
            f"{version}: {remedy}"
        )
    return document


def made_folder(place: Path) -> Path:
    """Make the folder that ``--out`` names, with those above it, and return it.

    - raises InputError: a file is in its way, or the disk refuses it.
    """
    try:
        place.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(
            f"{place} cannot be made a folder ({error.strerror or error}): choose another --out"
        ) from None
    return place


@contextmanager
def opened_zip(path: Path, data: bytes, largest: int) -> Iterator[ZipFile]:
    """Open a zip archive whose parts are neither too many nor too large.

    - `data`: content of `path`.
    - `largest`: of all parts together, unpacked [bytes].
    - raises InputError: they are more; a small archive may unpack to anything.
    - raises BadZipFile: no zip archive.
    """
    if data.count(b"PK\x01\x02") > MOST_PARTS:
        raise InputError(
            f"{path} has more than {MOST_PARTS} parts: check that it is the right file"
        )
    with ZipFile(io.BytesIO(data)) as parts:
        size = sum(part.file_size for part in parts.infolist())
        if size > largest:
            raise InputError(
                f"{path} unpacks to {size / MEBIBYTE:.0f} MiB, at most {largest / MEBIBYTE:.0f} "
                "MiB are read: split it"
            )
        yield parts


def read_arrays(path: Path, remedy: str) -> dict[str, npt.NDArray[Any]]:
    """Return the arrays of an npz file by name; their shapes are checked before they are read.

    - `remedy`: advice for the error, such as ``start a new run``.
    - raises InputError: as `read_bytes`; a damaged file, an array of objects, or one that announces
      more than the file holds.
    """
    data = read_bytes(path)  # all at once: numpy leaves a damaged file open
    try:
        with opened_zip(path, data, LARGEST_FILE) as parts:
            for part in parts.infolist():
                with parts.open(part) as file:
                    _check_header(file, part.file_size)
        with np.load(io.BytesIO(data), allow_pickle=False) as archive:
            return dict(archive)
    except InputError:
        raise
    except (OSError, ValueError, EOFError, RuntimeError, BadZipFile, zlib.error) as error:
        raise InputError(f"{path} cannot be read ({error}): it is damaged; {remedy}") from None


def _check_header(file: IO[bytes], size: int) -> None:
    """Refuse an array whose shape and type do not make the bytes that follow."""
    version = np.lib.format.read_magic(file)
    headers = {
        (1, 0): np.lib.format.read_array_header_1_0,
        (2, 0): np.lib.format.read_array_header_2_0,
    }
    if version not in headers:
        raise ValueError(f"version {version} of an array")
    try:
        shape, _, dtype = headers[version](file)
    except Exception:  # numpy takes the header for Python, and every kind of error of it may come
        raise ValueError("the header of an array is no header") from None
    if dtype.hasobject:
        raise ValueError("an array of objects")
    announced = math.prod(shape) * dtype.itemsize
    if min(shape, default=0) < 0 or not dtype.itemsize or announced != size - file.tell():
        raise ValueError(f"an array of shape {shape} is announced, and {size} bytes are there")


def replace_bytes(path: Path, data: bytes) -> None:
    """Write a file through a temporary one beside it; an existing file is replaced in one step.

    - raises InputError: the folder is missing or cannot be written.
    """
    try:
        with tempfile.TemporaryDirectory(prefix=".write-", dir=path.parent) as folder:
            scratch = Path(folder) / path.name
            with scratch.open("wb") as file:
                file.write(data)
                file.flush()
                # a rename may reach the disk before the data do
                os.fsync(file.fileno())
            scratch.replace(path)
    except OSError as error:
        raise InputError(
            f"{path} cannot be written ({error.strerror or error}): choose a folder that exists "
            "and may be written to"
        ) from None


def replace_text(path: Path, text: str) -> None:
    """Write UTF-8 text with the line ends it has, as `replace_bytes` does.

    - raises InputError: the folder is missing or cannot be written.
    """
    replace_bytes(path, text.encode("utf-8"))


@contextmanager
def complete_or_not_at_all(folder: Path) -> Iterator[Path]:
    """Give a sibling folder to write to, and rename it to `folder` at the end.

    - `folder`: a new or an empty folder.
    - yields: ``<folder>.unfinished``; deleted if an error leaves the block.
    - raises InputError: a folder that is not empty, cannot be written or lies there unfinished.
    """
    target = folder.resolve()
    if target.exists() and not target.is_dir():
        raise InputError(f"{folder} is a file: name a new or an empty folder")
    if target.is_dir() and any(target.iterdir()):
        raise InputError(f"{folder} is not empty: name a new or an empty folder")
    unfinished = target.with_name(f"{target.name}.unfinished")
    try:
        unfinished.mkdir(parents=True)
    except FileExistsError:
        raise InputError(f"{unfinished} is left from a run that was stopped: delete it") from None
    except OSError as error:
        raise InputError(
            f"{folder} cannot be written ({error.strerror or error}): name another folder"
        ) from None
    try:
        yield unfinished
        if target.is_dir():
            # a rename onto an existing folder is refused on Windows
            target.rmdir()
        unfinished.rename(target)
    except BaseException as error:
        shutil.rmtree(unfinished, ignore_errors=True)
        if isinstance(error, OSError):
            raise InputError(
                f"{folder} cannot be written ({error.strerror or error}): name another folder"
            ) from None
        raise
