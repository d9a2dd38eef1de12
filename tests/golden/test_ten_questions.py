"""Every page has an answer to each of ten questions on its first screen, or a reason.

That the words are there is looked at where the page is pinned, see `pinned_pages.hold`.
"""

import pytest

import ten_questions
from pinned_pages import PAGES

SAME_PAGE = {"compare_models": "compare", "judged_compressor": "unbalance"}
PAGE = """<header><h1>Mounts</h1><p class="verdict">Soften TSM x: &minus;3.0 dB.</p></header>
<div class="answer"><div><section class="panel"><h2>Each vehicle</h2></section></div></div>
<section aria-labelledby="section-1"><h2>How sure</h2><audio src="data:"></audio></section>"""


def asked_pages():
    pins = sorted(PAGES.glob("*.txt"))
    return [
        SAME_PAGE.get(pin.stem, pin.stem)
        for pin in pins
        if "== report.html\n" in pin.read_text(encoding="utf-8")
    ]


def test_every_pinned_page_of_a_study_is_asked():
    assert set(asked_pages()) <= set(ten_questions.PAGES)


@pytest.mark.parametrize("page", ten_questions.PAGES)
def test_each_question_has_words_or_a_reason(page):
    answers = ten_questions.PAGES[page]
    assert list(answers) == list(ten_questions.QUESTIONS)
    for answer in answers.values():
        words = answer if isinstance(answer, str) else answer["none"]
        assert words.strip()


def test_words_count_on_the_first_screen_alone():
    first, third, eighth = (ten_questions.QUESTIONS[number] for number in "138")
    answers = {"1": "Soften .* −3.0 dB", "2": "Each vehicle", "3": "How sure", "8": "(sound)"}
    faults = ten_questions.unanswered(PAGE, answers | {"4": {"none": "no peak is asked for"}})
    assert [fault.partition("?")[0] + "?" for fault in faults] == [third, eighth]
    assert ten_questions.unanswered(PAGE, {"1": "Stiffen"})[0].startswith(first)
