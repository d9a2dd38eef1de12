"""The live part of the interactive page, used by pointer, key and control in Chromium."""

import json

import numpy as np
import pytest
from interactive_front_samples import FULL_SCALE, data_of, live_front

from deboom.report.interactive import render_interactive


@pytest.fixture(scope="module")
def path(tmp_path_factory):
    path = tmp_path_factory.mktemp("live") / "interactive.html"
    path.write_text(render_interactive(live_front()[0]), encoding="utf-8")
    return path


@pytest.fixture
def page(browser, path):
    """Open the page anew; it must have complained of nothing and asked for nothing in the end."""
    browser.open(path, width=1440, height=900)
    fresh(browser)
    yield browser
    assert browser.complaints == []
    requested = [url for url in browser.requests if not url.startswith("blob:")]
    assert requested == [path.resolve().as_uri()]


FRESH = "live.session.band !== null && live.session.band.fresh"


def fresh(page):
    page.wait(FRESH)


def design(page):
    return np.array(page.value("[...live.session.x]"))


def cards(page):
    parts = "[...card.querySelectorAll('.name, .change, p')].map(part => part.textContent)"
    return page.value(f"[...document.querySelectorAll('#live .card')].map(card => {parts})")


def slider(name):
    return f'#live input[aria-label="stiffness of {name}"]'


def test_it_opens_with_best_mean_against_today_as_python_has_them(page):
    front, robust = live_front()
    best = np.array(front.live.header["starts"][0]["design"])
    np.testing.assert_array_equal(design(page), best)
    values = robust(np.vstack([np.ones(12), best]))
    mean = values.mean / front.frequency.size
    shown = cards(page)
    assert [name for name, *_ in shown] == ["U06-1", "U06-5"]  # those of the first group
    for card, v in zip(shown, (0, 1), strict=True):
        change = f"{mean[1, v] - mean[0, v]:+.1f} dB".replace("-", "−")
        assert card[1] == change
        half = 1.96 * values.sigma[1, v] / front.frequency.size
        assert card[2] == f"{mean[0, v]:.1f} → {mean[1, v]:.1f} ± {half:.1f} dB(A)"
    assert page.text("#live-title") == "Compact <b>platform"
    assert f"full scale {FULL_SCALE:.1f} Pa" in page.text("#live-facts")


def test_a_slider_moves_by_key_and_the_verdict_is_said_when_it_is_let_go(page):
    page.focus("#live-today")
    page.key("Enter")
    fresh(page)
    assert set(design(page)) == {1.0}
    assert page.text("#live-announced") == "As today in all 2 vehicles"
    page.focus(slider("TSM x"))
    page.key("Home")
    fresh(page)
    assert design(page)[6] == 0.8
    assert np.count_nonzero(design(page) != 1.0) == 1
    said = page.value(f"document.querySelector('{slider('TSM x')}').getAttribute('aria-valuetext')")
    assert said == "480 N/mm −20 %"
    assert "U06-1" in page.text("#live-announced")
    page.focus("#live-back")
    page.key("Enter")
    assert set(design(page)) == {1.0}
    page.focus("#live-again")
    page.key("Enter")
    assert design(page)[6] == 0.8
    press = (
        "document.body.dispatchEvent(new KeyboardEvent('keydown', {{key: '{}', {}bubbles: true}}))"
    )
    page.value(press.format("z", "ctrlKey: true, "))
    assert set(design(page)) == {1.0}
    page.value(press.format("Z", "ctrlKey: true, shiftKey: true, "))
    assert design(page)[6] == 0.8
    page.value(press.format("z", ""))
    assert design(page)[6] == 0.8
    page.focus(slider("EnM z"))
    page.key("End")
    fresh(page)
    assert page.value("document.getElementById('live-again').disabled")


def test_every_text_stands_out_from_what_lies_behind_it(page):
    texts, low = page.contrasts()
    assert texts > 100
    assert low == []
    page.value("document.getElementById('live-title').style.color = '#bbbbbb'")
    page.value("document.querySelector('#live-curves svg text').style.fill = 'rgb(0 0 0 / 40%)'")
    _, low = page.contrasts()
    # the ratio of #bbbbbb and of 40 % black to white, by WCAG's formula
    assert [round(text["ratio"], 2) for text in low] == [1.92, 2.85]


def test_the_address_keeps_the_design_and_refuses_one_of_other_variables(page, path):
    page.focus(slider("EnM z"))
    page.key("End")
    fresh(page)
    moved, address = design(page), page.value("location.hash")
    assert address.startswith("#live=")
    page.value("history.replaceState(null, '', '#')")
    page.value("location.hash = " + json.dumps(address))
    page.wait("live.session.x[2] === 1.2")
    np.testing.assert_allclose(design(page), moved, atol=1e-6)
    page.value("location.hash = '#live=' + encodeURIComponent('{\"variables\": [\"a x\"]}')")
    page.wait("document.getElementById('live-said').textContent !== ''")
    assert page.text("#live-said").startswith("These are designs of other variables")


def test_an_improvement_keeps_the_limits_as_python_judges_them(page):
    _, robust = live_front()
    page.value("document.querySelector('#live-groups input[value=all]').click()")
    page.value("document.getElementById('live-today').click()")
    fresh(page)
    n_lines = data_of_page(page)["nLines"]
    today = robust(np.ones((1, 12))).mean[0] / n_lines
    page.value("live.session.limits.peak[0] = 72.0")
    page.value("live.session.limits.atMost[0] = live.price(live.model.ones)[0] + 0.2")
    page.focus("#live-improve")
    page.key("Enter")
    page.wait("/steps in|Nothing|now;/.test(document.getElementById('live-said').textContent)")
    fresh(page)
    page.wait("document.getElementById('live-announced').textContent.includes('dB')")
    improved = design(page)
    mean = robust(improved[np.newaxis]).mean[0] / n_lines
    assert mean.mean() < today.mean() - 0.5
    assert np.all(mean <= today + 0.01)
    assert robust.evaluate.levels(improved[np.newaxis])[0, 0].max() <= 72.05
    assert page.value("live.price(live.session.x)[0] <= live.session.limits.atMost[0] + 0.01")
    # σ falls, and no vehicle becomes louder than today
    page.value("document.getElementById('live-objective').value = 'sigma'")
    before = robust(improved[np.newaxis]).sigma_sum[0]
    page.value("document.getElementById('live-said').textContent = ''")
    page.focus("#live-improve")
    page.key("Enter")
    page.wait("/steps in|Nothing|now;/.test(document.getElementById('live-said').textContent)")
    fresh(page)
    values = robust(design(page)[np.newaxis])
    assert values.sigma_sum[0] < before
    assert np.all(values.mean[0] / n_lines <= today + 0.01)


def data_of_page(page):
    return page.value("({nLines: live.data.nLines})")


def test_brushes_become_limits_and_a_pinned_design_the_start(page):
    page.value("brush(axes.find(axis => axis.name === 'TSM x'), 20, 60)")
    page.value("brush(axes.find(axis => axis.name === 'U06-5 level'), 0, 150)")
    page.focus("#to-limits")
    page.key("Enter")
    assert page.text("#live-said") == "2 brushes are limits of an improvement now."
    bounds = page.value("[live.session.lower[6], live.session.upper[6], live.session.upper[0]]")
    np.testing.assert_allclose(bounds, [0.84, 0.92, 1.2])
    # the ranges are in the address, and come back from it
    stated = page.value("live.stated()")
    np.testing.assert_allclose(stated["ranges"]["TSM x"], [0.84, 0.92])
    page.value("live.session.lower.set(live.data.lower), live.session.upper.set(live.data.upper)")
    assert page.value(f"live.take({json.dumps(stated)})") == ""
    bounds = page.value("[live.session.lower[6], live.session.upper[6], live.session.upper[0]]")
    np.testing.assert_allclose(bounds, [0.84, 0.92, 1.2])
    level = page.value("axes.find(axis => axis.name === 'U06-5 level')")
    wanted = level["lower"] + 0.75 * (level["upper"] - level["lower"])
    assert page.value("live.session.limits.mean[1]") == pytest.approx(wanted)
    page.value("pin('a', 2)")
    page.focus("#to-live")
    page.key("Enter")
    third = [axis.values[2] for axis in live_front()[0].axes[:12]]
    np.testing.assert_allclose(design(page), third, rtol=1e-6)


def test_parts_that_share_a_stiffness_move_together(page):
    page.value("document.querySelectorAll('#live-tab input')[2].click()")
    page.value(
        "(list => { list.value = 'GeM'; list.dispatchEvent(new Event('change')); })"
        "(document.querySelector('[aria-label=\"mount whose part EnM shares\"]'))"
    )
    x = design(page)
    np.testing.assert_array_equal(x[:3], x[3:6])
    page.focus(slider("GeM z"))
    page.key("Home")
    x = design(page)
    assert x[2] == x[5] == 0.8


def test_a_design_beyond_the_sliders_is_set_to_their_ends_and_said_so(page):
    page.value("axes.find(axis => axis.name === 'TSM z').values[1] = 1.5; pin('a', 1)")
    page.focus("#to-live")
    page.key("Enter")
    assert design(page)[8] == 1.2
    assert page.text("#live-said").endswith("so set to its end: TSM z.")


def test_load_cases_and_weights_change_the_levels(page):
    _, robust = live_front()
    titles = "[...document.querySelectorAll('#live-case option')].map(one => one.textContent)"
    assert len(page.value(titles)) == 6
    before = page.text("#live-verdict")
    page.value("live.session.caseWeights[5] = 3; live.refresh()")
    fresh(page)
    assert page.text("#live-verdict") != before
    assert "levels over 2 load cases" in page.text("#live-facts")
    assert robust.evaluate.load_case_names == ("g5_wot220",)


def test_pins_stand_in_a_table_and_a_saved_file_opens_again(page):
    page.focus("#live-pin")
    page.key("Enter")
    first = design(page)
    assert page.text("#live-pins tbody tr th") == "P1"
    page.focus("#live-today")
    page.key("Enter")
    page.focus("#live-save")
    page.key("Enter")
    kept = json.loads(page.downloaded("2026-seed-1_design.json"))
    assert kept["design"] == [1.0] * 12
    np.testing.assert_allclose(kept["pinned"][0]["design"], first, atol=1e-6)
    assert page.value(f"live.take({json.dumps({**kept, 'design': [0.9] * 12})})") == ""
    assert set(design(page)) == {0.9}
    assert "numbers" in page.value(f"live.take({json.dumps({**kept, 'design': [0.9]})})")
    page.focus("#live-pins button")
    page.key("Enter")
    np.testing.assert_allclose(design(page), first, atol=1e-6)


def test_the_live_part_needs_no_scrolling_and_a_phone_none_sideways(page):
    assert page.value("document.getElementById('live').getBoundingClientRect().bottom") <= 900
    for width in (1440, 800, 400):
        page.resize(width, 900)
        page.wait(f"document.documentElement.clientWidth === {width}")
        assert page.value("document.documentElement.scrollWidth") == width


def test_on_a_phone_two_screens_show_verdicts_sliders_curves_and_what_a_tenth_does(page, path):
    page.open(path, width=400, height=900)
    fresh(page)
    page.value("document.querySelector('#live-groups input[value=all]').click()")
    fresh(page)
    parts = ("#live-cards", "#live-sliders", "#live-curves", "#live-tornado")
    below = "document.querySelector('{}').getBoundingClientRect().bottom"
    ends = {part: page.value(below.format(part)) for part in parts}
    assert max(ends.values()) <= 2 * 900, ends


def test_on_a_phone_the_designs_of_the_run_are_folded_and_drawn_when_opened(page, path):
    page.open(path, width=400)
    page.wait("document.getElementById('live-cards').children.length > 0")
    assert not page.value("document.getElementById('designs').open")
    folded = page.value("document.documentElement.scrollHeight")
    page.value("document.getElementById('designs').open = true")
    page.wait("document.querySelector('#parallel svg').getBoundingClientRect().width > 300")
    assert folded < 0.7 * page.value("document.documentElement.scrollHeight")


def test_arrow_keys_read_a_curve(page):
    page.focus("#live-curves svg")
    page.key("ArrowRight", times=3)
    said = page.text("#live-announced")
    at = page.value("[live.session.line, live.data.cases[0].speed[live.session.line]]")
    assert at[0] == 3
    assert said.startswith(f"U06-1: {at[1]:.0f}/min: ")
    assert ", today " in said


LIMITS = """format = 1
[[level]]
vehicle = "U06-5"
at_most_db = 62.5
[[level]]
at_most_db = "today"
[[level]]
statistic = "tail"
vehicle = "U06-1"
at_most_db = 70.0
[[sag]]
mount = "EnM"
at_most_mm = 6.0
[[sag]]
mount = "EnM"
at_most_mm = 7.0
[[stiffness]]
variable = "GeM z"
at_least_n_per_mm = 350.0
"""


@pytest.fixture(scope="module")
def limited(tmp_path_factory):
    """Return a page of a run with limits, and what its header says of them."""
    folder = tmp_path_factory.mktemp("limited")
    stated = folder / "limits.toml"
    stated.write_text(LIMITS, encoding="utf-8")
    front, _ = live_front(limits=stated)
    path = folder / "interactive.html"
    path.write_text(render_interactive(front), encoding="utf-8")
    return path, front.live.header["limits"]


def test_limits_of_the_run_stand_in_the_page_or_are_said_to_be_not_judged(limited):
    """Nothing passes for kept that the page does not compute: the tail, |K|, a peak that rises."""
    _, limits = limited
    assert limits["mounts"] == {"EnM sag": {"at_most": 6.0}}
    assert limits["mean"] == {"U06-5": pytest.approx(62.5, rel=1e-12)}
    tail, stiffness, rise = limits["unjudged"]
    assert tail.startswith("'mean of the worst 5 % of SPLV")
    assert tail.endswith("at most 70 dB(A) per line' (limits.toml, [[level]] 3)")
    assert stiffness == "'GeM z stiffness at least 350 N/mm' (limits.toml, [[stiffness]] 1)"
    assert rise == "'rise of a booming peak at most 1 dB' (--peak-rise 1)"


def test_the_page_holds_the_limits_of_the_run_and_never_calls_others_kept(browser, limited):
    path, limits = limited
    browser.open(path, width=1440, height=900)
    fresh(browser)
    assert browser.value("live.session.limits.mean[1]") == pytest.approx(62.5)
    assert (
        browser.value("live.session.limits.atMost[live.data.price.names.indexOf('EnM sag')]") == 6
    )
    for tab in ("price", "weights"):
        browser.value(f"document.querySelector('#live-tab input[value={tab}]').click()")
        for words in limits["unjudged"]:
            assert f"Not judged here: {words}." in browser.text(f"#live-{tab}")
    browser.focus("#live-improve")
    browser.key("Enter")
    browser.wait("/steps in|Nothing|now;/.test(document.getElementById('live-said').textContent)")
    said = browser.text("#live-said")
    assert "all limits are kept" not in said
    assert "3 of the run that are not judged here" in said
    # a reader who clears the limits of the run keeps them cleared
    state = browser.value("live.stated()")
    assert state["limits"]["mounts"] == {"EnM sag": {"at_most": 6}}
    state["limits"] = {}
    assert browser.value(f"live.take({json.dumps(state)})") == ""
    assert browser.value("Number.isNaN(live.session.limits.mean[1])")
    assert browser.complaints == []


def test_a_pointer_reads_all_curves_at_one_speed(page):
    page.value("document.getElementById('live-today').click()")
    fresh(page)
    x, y, width = page.value(
        "(b => [b.x, b.y + b.height / 2, b.width])"
        "(document.querySelector('#live-curves svg').getBoundingClientRect())"
    )
    page.drag((x + width / 2, y))
    line = page.value("live.session.line")
    speed = page.value(f"live.data.cases[0].speed[{line}]")
    levels = live_front()[1].evaluate.levels(np.ones((1, 12)))[0, :2, line]
    shown = "[...document.querySelectorAll('#live-curves svg > text:last-of-type')]"
    read = page.value(f"{shown}.map(text => text.textContent)")
    for words, level in zip(read, levels, strict=False):
        assert words.startswith(f"{speed:.0f}/min: {level:.1f} (")
        assert words.endswith(f"today {level:.1f}")


def test_every_control_has_a_name(page):
    unnamed = page.value(
        "[...document.querySelectorAll('#live select, #live button, #live input, #live svg[role]')]"
        ".filter(e => !(e.labels && e.labels.length) && !e.getAttribute('aria-label')"
        " && !e.textContent).map(e => e.outerHTML.slice(0, 80))"
    )
    assert unnamed == []


def test_it_can_be_heard_at_the_scale_of_listen(page):
    page.focus("#live .card .foot button")
    page.key("Enter")
    assert page.value("document.querySelectorAll('#live .foot button.on').length") == 1
    page.key("Enter")
    assert page.value("document.querySelectorAll('#live .foot button.on').length") == 0
    header = data_of(render_interactive(live_front()[0]), "live-header")
    assert header["fullScale"] == FULL_SCALE
