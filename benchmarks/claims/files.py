"""Files: the door to disk, judged with the files of other programs and with damaged ones.

Vendor files come with pyuff, the ruler from pydvma; what is cut, timed or written here is made on
the spot in a temporary folder.
"""

import tempfile
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np

from claims import Claim
from deboom.errors import InputError
from deboom.files.platform import read_platform
from deboom.files.uff import UffFunction, read_uff, write_uff

ROOT = Path(__file__).parents[2]
VENDOR = ROOT / "tests" / "data" / "pyuff-vendor-files"
RULER = ROOT / "tests" / "data" / "pydvma-ruler"
PLATFORM = ROOT / "studies" / "data" / "u06_f39_f45"


def claims() -> list[Claim]:
    return [
        *_vendor_files(),
        _ruler(),
        *_round_trips(),
        *_damage(),
        *_speed(),
    ]


def _vendor_files() -> list[Claim]:
    read, refused, other = 0, 0, 0
    paths = sorted(VENDOR.glob("*.uff"))
    for path in paths:
        try:
            read_uff(path)
            read += 1
        except InputError:
            refused += 1
        except Exception:  # the failure that this claim is about
            other += 1
    (ascii_record,) = read_uff(VENDOR / "Sample_UFF58_ascii.uff")
    (binary_record,) = read_uff(VENDOR / "Sample_UFF58b_bin.uff")
    peaks = [float(np.max(np.abs(r.values))) for r in (ascii_record, binary_record)]
    return [
        Claim(
            "Vendor files are read, or refused with a sentence",
            "all",
            f"{read} read, {refused} refused, {other} failed, of {len(paths)}",
            other == 0 and read + refused == len(paths),
        ),
        Claim(
            "Peak of one recording [Pa], ASCII and binary export",
            "0.141304 in both",
            f"{peaks[0]:.8f} and {peaks[1]:.8f}, {ascii_record.values.size} samples",
            all(abs(peak - 0.141304) < 5e-7 for peak in peaks),
        ),
    ]


def _ruler() -> Claim:
    with np.load(RULER / "ruler_two_lines_0-2kHz.npz", allow_pickle=False) as arrays:
        truth = arrays["tf"]
    read = np.stack([f.values for f in read_uff(RULER / "ruler_two_lines_0-2kHz.uff")], axis=-1)
    error = float(np.max(np.abs(read - truth) / np.abs(truth)))
    return Claim(
        "A measured FRF is the same from UFF and from arrays, relative",
        "≤ 1e-7 (single precision)",
        f"{error:.2g}, {truth.size} values",
        error <= 1e-7,
    )


def _function(n_lines: int, seed: int) -> UffFunction:
    rng = np.random.default_rng(seed)
    magnitude = 10.0 ** rng.uniform(-12, 6, n_lines)
    return UffFunction(
        abscissa=20.0 + 0.25 * np.arange(n_lines),
        values=magnitude * np.exp(2j * np.pi * rng.random(n_lines)),
        function_type=4,
        response_node=seed,
        response_direction="+z",
        reference_node=1,
        reference_direction="-x",
        ordinate="acceleration",
        ordinate_unit="m/s^2",
        denominator="force",
        denominator_unit="N",
    )


def _round_trips() -> list[Claim]:
    functions = [_function(241, seed) for seed in range(1, 101)]
    found = []
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "a.uff"
        for binary, name, bound in ((False, "ASCII", 5e-12), (True, "binary", 0.0)):
            write_uff(path, functions, binary=binary)
            parts = [
                (part(a.values), part(b.values))
                for a, b in zip(functions, read_uff(path), strict=True)
                for part in (np.real, np.imag)
            ]
            error = max(float(np.max(np.abs(b - a) / np.abs(a))) for a, b in parts)
            found.append(
                Claim(
                    f"UFF round trip in {name}, relative, real and imaginary part",
                    f"≤ {bound:g}",
                    f"{error:.2g}, 100 functions × 241 lines over 18 decades",
                    error <= bound,
                )
            )
    return found


def _damage() -> list[Claim]:
    functions = [_function(20, seed) for seed in (1, 2, 3)]
    n_cut = n_changed = n_wrong = 0
    with tempfile.TemporaryDirectory() as folder:
        whole, cut = Path(folder) / "whole.uff", Path(folder) / "cut.uff"
        for binary in (False, True):
            write_uff(whole, functions, binary=binary)
            written = read_uff(whole)
            data = whole.read_bytes()
            for end in range(len(data)):
                n_cut += 1
                cut.write_bytes(data[:end])
                try:
                    read = read_uff(cut)
                except InputError:
                    continue
                pairs = zip(read, written, strict=False)
                n_changed += not all(np.array_equal(a.values, b.values) for a, b in pairs)
        for bad in (np.nan, np.inf, -np.inf, complex(0, np.nan)):
            for line in range(20):
                values = functions[0].values.copy()
                values[line] = bad
                try:
                    replace(functions[0], values=values)
                    n_wrong += 1
                except InputError:
                    pass
    return [
        Claim(
            "A UFF file cut at any byte never gives a shortened or changed function",
            "0 of all cuts",
            f"{n_changed} of {n_cut} cuts, ASCII and binary",
            n_changed == 0,
        ),
        Claim(
            "A function with one value that is not finite is refused",
            "80 of 80",
            f"{80 - n_wrong} of 80 (NaN, ±inf, each line of 20)",
            n_wrong == 0,
        ),
    ]


def _seconds(work: Callable[[], object], repeats: int) -> float:
    times = []
    for _ in range(repeats):
        begin = time.perf_counter()
        work()
        times.append(time.perf_counter() - begin)
    return min(times)


def _speed() -> list[Claim]:
    functions = [_function(1600, seed) for seed in range(1, 973)]
    found = []
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "a.uff"
        for binary, name, bound in ((False, "ASCII", 15.0), (True, "binary", 8.0)):
            seconds = _seconds(lambda binary=binary: write_uff(path, functions, binary=binary), 1)
            found.append(
                Claim(
                    f"Write 972 functions of 1600 lines, {name}",
                    f"≤ {bound:g} s",
                    f"{seconds:.2g} s, read back in {_seconds(lambda: read_uff(path), 1):.2g} s",
                    seconds <= bound,
                )
            )
    seconds = _seconds(lambda: read_platform(PLATFORM), 3)
    found.append(
        Claim(
            "Read the shipped platform",
            "≤ 3 s",
            f"{seconds:.2g} s, {len(read_platform(PLATFORM).input_files)} files",
            seconds <= 3.0,
        )
    )
    return found
