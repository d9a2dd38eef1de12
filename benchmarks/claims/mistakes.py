"""What people do wrong, and whether `deboom check` says where.

Every mistake of `tests/samples/mistakes.py` on folders of seeds that no check was tuned on, drawn
in place and size. A mistake is named if a fault, a WARNING or an ALARM holds a word that tells
where it is. Folders without a mistake must raise nothing.
"""

from __future__ import annotations

import numpy as np

from claims import Claim, at_least, at_most, draws, in_processes
from deboom.choices import FolderKind
from samples.mistakes import LAST_TUNING, alarms, outcomes

FIRST = LAST_TUNING + 101
SEEDS = range(FIRST, FIRST + draws(2))
RIGHT = {FolderKind.platform: 40, FolderKind.campaign: 20, FolderKind.compressor: 20}


def claims() -> list[Claim]:
    """Build all mistakes on two seeds, and the folders without."""
    built = [each for seed in in_processes(_built, SEEDS) for each in seed]
    visible = [named for seen, named in built if seen]
    rows = [
        at_least(
            f"mistakes named of {len(visible)} that data can show [%]",
            85.0,
            100.0 * np.mean(visible),
            1,
        )
    ]
    for kind, number in RIGHT.items():
        said = in_processes(_alarmed, [kind] * number, range(FIRST, FIRST + number))
        topic = f"{number} right folders, {kind.value}: with a fault, WARNING or ALARM"
        rows.append(at_most(topic, 0, sum(said), 0))
    return rows


def _built(seed: int) -> list[tuple[bool, bool]]:
    return [(each.mistake.visible, each.named) for each in outcomes(seed)]


def _alarmed(kind: FolderKind, seed: int) -> bool:
    return bool(alarms(kind, seed))
