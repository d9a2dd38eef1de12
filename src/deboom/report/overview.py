"""The page that leads to all results: one entry per run, the newest of each study first."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from importlib.resources import files


@dataclass(frozen=True)
class RunCard:
    """What the page says of one run.

    Parameters
    ----------
    study, name : str
        Of the run.
    question : str
        What it asked.
    state : str
        ``finished``, ``running`` or ``unfinished``.
    started : str
        Date and time, UTC.
    seed : int
        Of the run.
    headlines : mapping of str to str
        Label → value with its unit.
    folder : str
        Its folder, relative to the page, with forward slashes.
    report : str
        Its report, relative to the page; empty if there is none.
    interactive : str
        The page to explore its front, likewise.
    special : str
        What sets it apart from the study's other runs, in one line; may be empty.
    call : str
        How it was called.
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


def render_overview(cards: Sequence[RunCard], problems: Sequence[str] = ()) -> str:
    """Render the page: one self-contained HTML file that links to the reports beside it.

    Parameters
    ----------
    cards : sequence of RunCard
        All runs.
    problems : sequence of str
        Runs that could not be read.

    Returns
    -------
    str
        HTML; save as UTF-8 in the folder that the links are relative to.
    """
    from jinja2 import Environment, StrictUndefined

    environment = Environment(
        autoescape=True, undefined=StrictUndefined, trim_blocks=True, lstrip_blocks=True
    )
    template = environment.from_string(
        files("deboom.report").joinpath("overview.html").read_text(encoding="utf-8")
    )
    studies: dict[str, list[RunCard]] = {}
    for card in sorted(cards, key=lambda card: (card.started, card.name), reverse=True):
        studies.setdefault(card.study, []).append(card)
    return template.render(studies=studies, problems=list(problems), count=len(cards))
