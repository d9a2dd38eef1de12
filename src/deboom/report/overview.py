"""The page that leads to all results: one entry per run, the newest of each study first."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from deboom.report.report import rendered


@dataclass(frozen=True)
class RunCard:
    """What the page says of one run.

    - `question`, `state`, `started` (UTC; empty where nothing says it), `seed`: of the run.
    - `headlines`: label → value with its unit.
    - `folder`, `report`, `interactive`: links relative to the page; empty where there is none.
    - `special`: what sets it apart from the study's other runs, in one line; may be empty.
    - `call`: how it was called.
    - `platform`: name of its platform's folder; `verdict`: its answer in a sentence; both may be
      empty.
    - `thumbnail`: link to the picture that stands for it; empty where it has none.
    - `sheets`: name → link of the pages for a supplier.
    """

    study: str
    name: str
    question: str
    state: str
    started: str
    seed: int
    headlines: Mapping[str, str]
    folder: str
    report: str
    interactive: str
    special: str
    call: str
    platform: str = ""
    verdict: str = ""
    thumbnail: str = ""
    sheets: Mapping[str, str] = field(default_factory=dict)


def render_overview(cards: Sequence[RunCard], problems: Sequence[str] = ()) -> str:
    """Render one self-contained HTML page that links to the reports beside it.

    - `cards`: all runs; `problems`: runs that could not be read.
    """
    studies: dict[str, list[RunCard]] = {}
    for card in sorted(cards, key=lambda card: (card.started, card.name), reverse=True):
        studies.setdefault(card.study, []).append(card)
    return rendered("overview.html", studies=studies, problems=list(problems), count=len(cards))
