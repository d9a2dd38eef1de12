"""Which blocks of a measurement were averaged, which were not, and why."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from deboom.errors import InputError


@dataclass(frozen=True)
class BlockRecord:
    """What became of one block.

    Parameters
    ----------
    number : int
        From 1, in the order measured.
    peak : float
        Largest excitation; of several inputs, of the first one [its unit].
    used : bool
        Whether it is part of the average.
    reasons : tuple of str
        Why not; empty when used.
    """

    number: int
    peak: float
    used: bool
    reasons: tuple[str, ...] = ()


def chosen_blocks(
    records: Sequence[BlockRecord],
    numbers: Sequence[int] | None = None,
    count: int | None = None,
) -> tuple[BlockRecord, ...]:
    """Mark what a choice by number or by count leaves out; what was rejected stays rejected.

    Parameters
    ----------
    records : sequence of BlockRecord
        One per block.
    numbers : sequence of int, optional
        Of the blocks to keep, from 1; by default all.
    count : int, optional
        How many of the good ones to keep, the first ones; by default all.

    Returns
    -------
    tuple of BlockRecord
        In their order.

    Raises
    ------
    InputError
        A number that is not there or doubled, a count below 1, or above the number of good hits.
    """
    known = [record.number for record in records]
    wanted = known if numbers is None else list(numbers)
    missing = sorted(set(wanted) - set(known))
    if missing or len(set(wanted)) != len(wanted):
        raise InputError(f"hits {list(wanted)}: choose among {known}, each once")
    if count is not None and count < 1:
        raise InputError(f"{count} hits cannot be averaged: choose at least 1")
    chosen, n_used = [], 0
    for record in records:
        reason = ""
        if record.number not in wanted:
            reason = "not chosen"
        elif record.used and count is not None and n_used == count:
            reason = f"after the first {count} good hits"
        if reason:
            reasons = (*record.reasons, reason)
            record = BlockRecord(record.number, record.peak, False, reasons)
        n_used += record.used
        chosen.append(record)
    if count is not None and n_used < count:
        raise InputError(
            f"{count} good hits were asked for, there are {n_used}: {summary(records)}"
        )
    return tuple(chosen)


def summary(records: Sequence[BlockRecord]) -> str:
    """Return one sentence on which hits were rejected and why."""
    rejected = [
        f"hit {record.number}: {', '.join(record.reasons)}" for record in records if not record.used
    ]
    return "; ".join(rejected) if rejected else f"all {len(records)} hits are good"
