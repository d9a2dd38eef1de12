"""Everything that is missing or wrong in a platform folder, at once, or what the platform holds.

The readers of the studies read it, see `deboom.files.faults`: what they refuse is told, each fault
with its file, its item and the remedy.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from deboom.errors import InputError
from deboom.files.faults import noting
from deboom.files.platform import PLATFORM_FILE, Platform, assembled, read_contents
from deboom.files.platform_file import load_right_platform_file
from deboom.mounts.operating_stiffness import refuse_active_mounts
from deboom.physics.orders import rpm_of_frequency
from deboom.study.mount_source import LIBRARY_FILE, MountSource, operation

BAND = (20.0, 60.0)
"""What the studies sum over; both edges belong to it [Hz]."""


@dataclass(frozen=True, eq=False)
class PlatformCheck:
    """What a check found.

    Parameters
    ----------
    faults : tuple of str
        A sentence each.
    waiting : tuple of str
        What could not be looked at because of them.
    platform : Platform or None
        What studies would read; None with a fault in its files.
    """

    faults: tuple[str, ...]
    waiting: tuple[str, ...]
    platform: Platform | None

    @property
    def summary(self) -> str:
        """What a platform without a fault holds, one item a line; empty with one."""
        if self.faults or self.platform is None:
            return ""
        return "\n".join(f"{name:<13}{text}" for name, text in _summary(self.platform))


def check_platform(folder: Path) -> PlatformCheck:
    """Read a platform folder to its end and list what is wrong.

    Parameters
    ----------
    folder : Path
        With ``platform.toml``.

    Returns
    -------
    PlatformCheck
        Beyond what `deboom.files.platform.read_platform` refuses: mounts that would be active,
        no line in the band of the studies, a mount library that does not fit.
    """
    faults: list[InputError] = []
    waiting: list[str] = []
    platform = None
    if not folder.is_dir():
        sentence = f"{folder}: there is no such folder: `deboom new platform {folder}` writes one"
        return PlatformCheck((sentence,), (), None)
    with noting(faults.append):
        file = load_right_platform_file(folder / PLATFORM_FILE, faults.append)
        contents = read_contents(folder, file, faults.append)
        if contents.mounts is None:
            waiting.append("whether the tables fit the mounts")
        if not contents.channels:
            waiting.append("whether the files hold the channels")
        if faults:
            waiting.append("signs, frequency band and mount library")
        else:
            platform = assembled(folder, file, contents)
    if platform is not None:
        for case in platform.load_cases:
            with noting(faults.append):
                refuse_active_mounts(case)
        with noting(faults.append):
            _refuse_empty_band(platform)
        if not faults and (folder / LIBRARY_FILE).exists():
            with noting(faults.append):
                every = [case.name for case in platform.load_cases]
                operation(platform, every, MountSource.library_inside, None, BAND)
    sentences = dict.fromkeys(str(fault) for fault in faults)
    return PlatformCheck(tuple(sentences), tuple(waiting), platform)


def _refuse_empty_band(platform: Platform) -> None:
    lines = platform.load_cases[0].force.frequency
    if not np.any((lines >= BAND[0]) & (lines <= BAND[1])):
        raise InputError(
            f"{platform.folder}: lines from {lines[0]:g} to {lines[-1]:g} Hz, and none in the "
            f"{BAND[0]:g} to {BAND[1]:g} Hz that studies sum over: export spectra and transfer "
            "functions over this band"
        )


def _summary(platform: Platform) -> Iterator[tuple[str, str]]:
    case = platform.load_cases[0]
    lines = case.force.frequency
    inside = lines[(lines >= BAND[0]) & (lines <= BAND[1])]
    rpm = rpm_of_frequency(inside[[0, -1]], case.order)
    variables = sum(len(mount.variables) for mount in platform.mounts)
    groups = dict.fromkeys(vehicle.group for vehicle in platform.fleet.vehicles)
    steps = np.diff(lines)
    even = np.ptp(steps) <= 1e-3 * steps.mean()
    yield "platform", f"{platform.name}: {platform.title}"
    yield (
        "mounts",
        f"{len(platform.mounts)}, {variables} variables: "
        + ", ".join(
            mount.name
            + (f" ({', '.join(mount.pieces)})" if len(mount.pieces) > 1 else "")
            + f" {''.join(mount.transfer_axes) or 'no path'}"
            for mount in platform.mounts
        ),
    )
    for group in groups:
        names = [one.name for one in platform.fleet.vehicles if one.group == group]
        yield "vehicles", f"{len(names)} in group {group}: {', '.join(names)}"
    yield (
        "lines",
        f"{lines.size}, {lines[0]:g} to {lines[-1]:g} Hz, "
        + (f"every {steps.mean():.4g} Hz" if even else "unevenly spaced"),
    )
    for one in platform.load_cases:
        default = " (default)" if one.name == platform.default_load_case else ""
        torque = "with engine torque" if one.engine_torque is not None else "no engine torque"
        yield "load case", f"{one.name}{default}: {one.title}; gear {one.gear}, {torque}"
    yield (
        "band",
        f"{inside.size} lines in {BAND[0]:g} to {BAND[1]:g} Hz: {rpm[0]:.0f} to {rpm[1]:.0f} rpm "
        f"of order {case.order:g}",
    )
    if (platform.folder / LIBRARY_FILE).exists():
        yield "library", f"{LIBRARY_FILE} fits all mounts"
    else:
        yield "library", f"no {LIBRARY_FILE}: studies need --mounts spectra"
