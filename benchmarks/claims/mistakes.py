"""What people do wrong, and whether `deboom check` says where.

Every mistake of `tests/samples/mistakes.py` on folders of seeds that no check was tuned on, drawn
in place and size, and those of `tests/samples/later_mistakes.py`, which were written down before
their checks. A mistake is named if a fault, a WARNING or an ALARM holds a word that tells where it
is. Folders without a mistake must raise nothing: they are drawn over the bench's families, five
kinds of bodies by turns, rubber and laboratory with up to four times the stated noise; compressors
and components have bodies that are drawn, and four classes of calibration.
"""

from __future__ import annotations

import numpy as np

from claims import Claim, at_least, at_most, draws, in_processes
from deboom.files.kinds import FolderKind
from samples.later_mistakes import LATER
from samples.mistakes import LAST_TUNING, alarms, outcomes

FIRST = LAST_TUNING + 601
SEEDS = range(FIRST, FIRST + draws(2))
RIGHT = {
    FolderKind.campaign: (40, "rubber and laboratory drawn"),
    FolderKind.platform: (20, "bodies, rubber and laboratory drawn"),
    FolderKind.compressor: (20, "body, rubber and calibration drawn"),
    FolderKind.component: (20, "source, bodies and calibration drawn"),
}


def claims() -> list[Claim]:
    """Build all mistakes on two seeds, and the folders without."""
    rows = []
    built = [each for seed in in_processes(_built, SEEDS) for each in seed]
    for which, later in (("", False), ("later ", True)):
        visible = [named for is_later, seen, named in built if seen and is_later is later]
        topic = f"{which}mistakes named of {len(visible)} that data can show [%]"
        rows.append(at_least(topic, 85.0, 100.0 * np.mean(visible), 1))
    for kind, (number, drawn) in RIGHT.items():
        said = in_processes(_alarmed, [kind] * number, range(FIRST, FIRST + number))
        topic = f"{number} right folders, {kind.value}, {drawn}: with a fault, WARNING or ALARM"
        rows.append(at_most(topic, 0, sum(said), 0))
    return rows


def _built(seed: int) -> list[tuple[bool, bool, bool]]:
    return [(each.mistake in LATER, each.mistake.visible, each.named) for each in outcomes(seed)]


def _alarmed(kind: FolderKind, seed: int) -> bool:
    return bool(alarms(kind, seed))
