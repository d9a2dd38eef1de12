"""What is looked at, refused or reported before and after the load inside is found."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from deboom.arrays import RealArray
from deboom.compressor.identify import ALARM
from deboom.errors import InputError
from deboom.measurement.channels import Spectrum
from deboom.measurement.operating_sweep import HoseState, OperatingSweep, OperatingTest

if TYPE_CHECKING:
    from deboom.compressor.modes import ModalTable
    from deboom.compressor.mount_state import MountState
    from deboom.compressor.sources import ResidualBand, Sources

BEYOND_MODES = 1.5
"""Times the highest rigid-body mode: from there on the body's inertia carries the load [1]."""
SMALLEST_LINES = 8
HOSES_ABOVE = 60.0
"""Hoses have their bending modes above [Hz]."""
VISIBLE_SHARE = 0.02
"""Of the load from which a rest is that of hoses [1]."""


def sweeps_of(
    test: OperatingTest, hoses: HoseState | None
) -> tuple[tuple[OperatingSweep, ...], list[str]]:
    """Choose the sweeps that show the load best.

    Parameters
    ----------
    test : OperatingTest
    hoses : HoseState or None
        Wanted; by default soft ones before standard ones.

    Returns
    -------
    sweeps : tuple of OperatingSweep
    notices : list of str

    Raises
    ------
    InputError
        No sweep with the hoses that are wanted.
    """
    if hoses is not None:
        sweeps = test.with_hoses(hoses)
        if not sweeps:
            raise InputError(f"{test.name}: there is no sweep with {hoses.value} hoses")
        return sweeps, []
    for state in (HoseState.ABSENT, HoseState.SOFT):
        if test.with_hoses(state):
            return test.with_hoses(state), []
    return test.with_hoses(HoseState.STANDARD), [
        "There is no sweep with soft hoses: what the standard hoses do to the compressor is part "
        "of the loads."
    ]


def within_hammer_test(
    sweeps: Sequence[OperatingSweep], hammer: RealArray
) -> tuple[tuple[OperatingSweep, ...], list[str]]:
    """Leave out lines that the hammer test did not measure.

    Parameters
    ----------
    sweeps : sequence of OperatingSweep
    hammer : array, shape (n,)
        Its lines [Hz].

    Returns
    -------
    sweeps : tuple of OperatingSweep
    notices : list of str
        What was left out.

    Raises
    ------
    InputError
        A sweep that the hammer test hardly covers.
    """
    kept, notices = [], []
    for sweep in sweeps:
        inside = (sweep.frequency >= hammer[0]) & (sweep.frequency <= hammer[-1])
        if np.count_nonzero(inside) < SMALLEST_LINES:
            raise InputError(
                f"sweep {sweep.name} has {np.count_nonzero(inside)} lines within the hammer test's "
                f"{hammer[0]:g} to {hammer[-1]:g} Hz, at least {SMALLEST_LINES} are needed: strike "
                "and run over the same range, in steps of 1 Hz or so"
            )
        if not inside.all():
            notices.append(
                f"Sweep {sweep.name}: {np.count_nonzero(~inside)} lines outside of the hammer "
                f"test's {hammer[0]:g} to {hammer[-1]:g} Hz are left out."
            )
            sweep = replace(
                sweep,
                acceleration=_lines(sweep.acceleration, inside),
                deviation=sweep.deviation[inside],
                holder=None if sweep.holder is None else _lines(sweep.holder, inside),
                sound=None if sweep.sound is None else _lines(sweep.sound, inside),
            )
        kept.append(sweep)
    return tuple(kept), notices


def refuse_resonant_sweep(sweeps: Sequence[OperatingSweep], modes: ModalTable) -> None:
    """Refuse sweeps that never leave the rigid-body resonances.

    Parameters
    ----------
    sweeps : sequence of OperatingSweep
    modes : ModalTable

    Raises
    ------
    InputError
        Too few lines above the modes.
    """
    highest = float(np.max(modes.frequency))
    for sweep in sweeps:
        above = np.count_nonzero(sweep.frequency >= BEYOND_MODES * highest)
        if above < min(SMALLEST_LINES, sweep.frequency.size):
            raise InputError(
                f"sweep {sweep.name} ends at {sweep.speed[-1]:.0f} 1/min and never leaves the "
                f"resonances of the mounted compressor, the highest of which lies at {highest:.1f} "
                f"Hz: {above} lines above {60 * BEYOND_MODES * highest:.0f} 1/min do not tell an "
                f"unbalance from a mount, at least {SMALLEST_LINES} are needed"
            )


def hose_alarms(sweeps: Sequence[OperatingSweep], bands: Sequence[ResidualBand]) -> list[str]:
    """Report loads that look like hoses.

    Parameters
    ----------
    sweeps : sequence of OperatingSweep
        That were fitted.
    bands : sequence of ResidualBand
        What the fit left.

    Returns
    -------
    list of str
        In words; empty where there is nothing.
    """
    seen = [
        band
        for band in bands
        if band.low >= HOSES_ABOVE and band.share > VISIBLE_SHARE and band.reduced_chi > ALARM
    ]
    if not seen:
        return []
    worst = max(seen, key=lambda band: band.share)
    text = (
        f"{worst.share:.1%} of the load in {worst.low:g}-{worst.high:g} Hz comes from no rotor and "
        "no gas, as it does with hoses joined"
    )
    if all(sweep.hoses is not HoseState.STANDARD for sweep in sweeps):
        text += (
            f", though these are reported as {sweeps[0].hoses.value}: check what was joined, and "
            "how long and soft it is"
        )
    return [f"{text}. The state of the mounts cannot be told apart from them."]


def load_alarms(
    sweeps: Sequence[OperatingSweep], found: Sources, mismatch: float, state: MountState
) -> list[str]:
    """Report what rotor, gas and mounts as struck do not explain.

    Parameters
    ----------
    sweeps : sequence of OperatingSweep
        That were fitted.
    found : Sources
    mismatch : float
        Change of the mounts that no common factor describes, 1 σ per direction [1].
    state : MountState

    Returns
    -------
    list of str
        In words; empty where there is nothing.
    """
    alarms = hose_alarms(sweeps, found.residual_bands)
    if alarms:
        return alarms
    if state.changed:
        alarms.append(state.statement)
    if found.remaining_chi > ALARM:
        alarms.append(
            f"The loads differ from rotor, gas and mounts by {found.remaining_chi:.1f} times their "
            f"noise (alarm at {ALARM:g})."
        )
    elif found.reduced_chi > ALARM:
        alarms.append(
            f"One factor for all mounts misses the loads by {found.reduced_chi:.1f} times their "
            f"noise (alarm at {ALARM:g}): the mounts have changed by some {mismatch:.1%} per "
            "direction besides, as they do where they soften with their own motion. The numbers "
            "of all speeds together allow for it."
        )
    return alarms


def unsettled_alarms(letters: Iterable[str]) -> list[str]:
    """Report fits that did not come to an end.

    Parameters
    ----------
    letters : iterable of str
        Of their routes.

    Returns
    -------
    list of str
        In words; empty where every fit did.
    """
    routes = ", ".join(letters)
    if not routes:
        return []
    return [
        f"The fit over all sweeps did not settle by route {routes}: its numbers and intervals are "
        "not to be trusted."
    ]


def _lines(spectrum: Spectrum, lines: np.ndarray) -> Spectrum:
    return Spectrum(
        spectrum.frequency[lines], spectrum.values[lines], spectrum.channels, spectrum.unit
    )
