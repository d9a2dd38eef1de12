"""Ten questions of a project leader, and where the first screen of each page answers them.

`ten_questions.toml` has the questions, and for each page and question either words of the answer,
as a regular expression, or the reason why the question does not apply.
"""

import re
import tomllib
from html import unescape
from pathlib import Path

FILE = tomllib.loads(Path(__file__).with_suffix(".toml").read_text(encoding="utf-8"))
QUESTIONS = {str(number): text for number, text in enumerate(FILE["questions"], 1)}
PAGES = {name: page for name, page in FILE.items() if name != "questions"}
FIRST = re.compile(r"(?s)<header>(.*?)(?:<nav |<aside |<section (?!class=\"panel\")|<footer)")
SOUND = re.compile(r"<audio[^>]*>")


def unanswered(page, answers):
    """Return the questions that the first screen of a page leaves open, with the words it lacks.

    Its first screen ends before its contents, its warnings and its first section.

    - `page`: text of ``report.html``; `answers`: by the number of the question, see `PAGES`.
    """
    lacking = missing(FIRST.search(page)[1], answers)
    return [
        f"{QUESTIONS[number]} {answers[number]!r} is not on the first screen" for number in lacking
    ]


def missing(html, answers):
    """Return the numbers of the questions whose words are not in a part of a page.

    A sound reads ``(sound)``.
    """
    text = re.sub(r"<[^>]*>", " ", SOUND.sub(" (sound) ", html))
    words = " ".join(unescape(text).split())
    return [
        number
        for number, answer in answers.items()
        if isinstance(answer, str) and not re.search(answer, words)
    ]
