"""The interactive page: safe against any name, and used by pointer, key and control."""

import base64
import csv
import io
import re
from dataclasses import replace

import numpy as np
import pytest
from interactive_front_samples import VEHICLES, N, data_of, front

from deboom.errors import InputError
from deboom.physics.sound_level import a_weighting
from deboom.report import interactive
from deboom.report.interactive import render_interactive
from deboom.report.report import Picture


@pytest.fixture(scope="module")
def path(tmp_path_factory):
    path = tmp_path_factory.mktemp("page") / "interactive.html"
    path.write_text(render_interactive(front()), encoding="utf-8")
    return path


@pytest.fixture
def page(browser, path):
    """Open the page anew; it must have complained of nothing and asked for nothing in the end."""
    browser.open(path)
    yield browser
    assert browser.complaints == []
    assert browser.requests == [path.resolve().as_uri()]


def axis_place(page, number):
    """Middle, top and bottom of an axis of the parallel coordinates on the screen [px]."""
    lines = "[...document.querySelectorAll('#parallel line')].map(l => l.getBoundingClientRect())"
    return page.value(f"(b => [b.x + b.width / 2, b.top, b.bottom])({lines}[{number}])")


def count(page):
    return int(page.text("#count strong"))


def selected(page):
    return page.text("#count") + page.text("#brushed")


def cells(page, table, row):
    rows = f"document.querySelectorAll('#{table} tbody tr')[{row}].children"
    return page.value(f"[...{rows}].map(cell => cell.textContent)")


def test_it_opens_with_today_and_two_picks(page):
    assert selected(page) == "9 of 9 designs selected, no brush"
    assert page.value("document.getElementById('pin-a').selectedOptions[0].text") == (
        "design 1, best-mean"
    )
    assert page.value("document.getElementById('pin-b').selectedOptions[0].text") == (
        "design 9, sigma-kept"
    )
    told = ["Front x", "100", "70", "130", "+60", "0.700", "1.300"]
    assert cells(page, "stiffness", 0)[:7] == told
    assert cells(page, "stiffness", 1)[1:5] == ["–"] * 4
    assert cells(page, "stiffness", 1)[7] == "no requirement"
    assert cells(page, "vehicles", 1)[:5] == [VEHICLES[1], "60.00", "50.00", "58.00", "+8.00"]
    assert page.text("#stiffness caption").startswith("A is design 1, best-mean; B is design 9")


def test_a_drag_along_an_axis_and_its_sliders_brush_alike(page):
    x, top, bottom = axis_place(page, 0)
    middle = (top + bottom) / 2
    page.drag((x, bottom + 4), (x, bottom - 20), (x, middle))
    assert selected(page) == "5 of 9 designs selected: Front x 70 to 100 N/mm"
    high = "#brushes fieldset:first-child input:last-child"
    assert page.value(f"document.querySelector('{high}').value") == "100"
    page.focus("#more summary")
    page.key("Enter")
    page.focus(high)
    page.key("Home")
    assert selected(page) == "1 of 9 designs selected: Front x 70 to 70 N/mm"
    page.key("ArrowRight", times=26)
    assert selected(page) == "2 of 9 designs selected: Front x 70 to 78 N/mm"
    told = f"document.querySelector('{high}').getAttribute('aria-valuetext')"
    assert page.value(told) == "78 N/mm"
    page.key("End")
    assert selected(page) == "9 of 9 designs selected, no brush"


def test_a_box_in_the_scatter_brushes_both_axes(page):
    dots = "[...document.querySelectorAll('#scatter circle')].map(c => c.getBoundingClientRect())"
    page.value("document.getElementById('scatter').scrollIntoView({block: 'center'})")
    places = page.value(f"{dots}.slice(0, {N}).map(b => [b.x + b.width / 2, b.y + b.height / 2])")
    (x0, y0), (x1, y1) = places[2], places[4]
    page.drag((x0 - 4, y0 - 4), (x0, y0), (x1 + 4, y1 + 4))
    assert count(page) == 3
    assert ": mean level 5" in selected(page)
    assert "; σ 0." in selected(page)
    page.drag((places[6][0], places[6][1]))
    assert page.text("#stiffness caption").startswith("A is design 7;")
    page.focus("#clear")
    page.key(" ")
    assert count(page) == N


def test_a_click_on_a_brushed_axis_and_escape_take_the_brush_off(page):
    x, top, bottom = axis_place(page, 0)
    for unbrush in (lambda: page.drag((x, top + 3)), lambda: page.key("Escape")):
        page.drag((x, bottom), (x, bottom - 30))
        assert count(page) < N
        page.focus("#parallel svg")
        unbrush()
        assert count(page) == N


def test_keys_walk_through_the_selection_and_pin(page):
    page.focus("#scatter svg")
    page.key("ArrowRight", times=3)
    assert page.text("#pointed") == "design 3: mean level 52.00 dB(A), σ 0.90 dB"
    page.key("Enter")
    page.key("End")
    page.key("ArrowLeft")
    page.key("Enter", shift=True)
    assert page.text("#stiffness caption").startswith("A is design 3; B is design 8.")
    page.value("document.getElementById('click-b').focus()")
    page.key(" ")
    page.focus("#parallel svg")
    page.key("Home")
    page.key("Enter")
    assert page.text("#stiffness caption").startswith("A is design 3; B is design 1, best-mean.")


def test_a_pin_can_be_chosen_from_the_list_even_todays(page):
    page.focus("#pin-b")
    page.key("Home")
    assert "B is today's." in page.text("#stiffness caption")
    assert cells(page, "stiffness", 0)[3] == "100"


def test_factors_vehicle_axes_and_the_line_read_are_controls(page):
    page.value("document.getElementById('in-stiffness').focus()")
    page.key("ArrowRight")
    x, _, bottom = axis_place(page, 0)
    page.drag((x, bottom), (x, bottom - 30))
    assert re.search(r"Front x 0\.700 to 0\.\d{3}$", selected(page))
    axes = "document.querySelectorAll('#parallel line').length"
    assert page.value(axes) == 11
    page.focus("#with-vehicles")
    page.key(" ")
    assert page.value(axes) == 13
    page.focus("#line")
    page.key("End")
    assert page.text("#line-value") == "33.30 Hz, 999 rpm"
    levels = front().levels[[0, 1, N], 0, -1]
    wanted = [f"{level:.1f}" for level in levels]
    assert cells(page, "vehicles", 0)[5:8] == wanted


def test_the_selection_is_exported_as_csv(page):
    x, _, bottom = axis_place(page, 0)
    page.drag((x, bottom + 2), (x, bottom - 5), (x, bottom - 50))
    shown = count(page)
    page.focus("#export")
    page.key("Enter")
    rows = list(csv.DictReader(io.StringIO(page.downloaded("2026-seed-1_selection.csv"))))
    given = front()
    assert 0 < len(rows) == shown < N
    assert [row["point"] for row in rows] == [str(k + 1) for k in range(shown)]
    assert rows[0]["pick"] == "best-mean"
    assert rows[0]["pin"] == "A"
    assert "Front y [N/mm]" not in rows[0]
    for k, row in enumerate(rows):
        for axis in given.axes:
            np.testing.assert_allclose(
                float(row[f"{axis.name} [{axis.unit}]"]), axis.values[k], rtol=1e-6
            )
        assert float(row["Rear z [N/mm]"]) == pytest.approx(900.0 * given.axes[8].values[k])


def test_tab_reaches_every_control_and_shows_where_it_is(page):
    page.value("document.getElementById('more').open = true")
    seen = []
    for _ in range(80):
        page.key("Tab")
        name, outline = page.value(
            "(e => [e.id || e.ariaLabel || e.getAttribute('aria-label') || e.tagName,"
            " getComputedStyle(e).outlineWidth])(document.activeElement)"
        )
        if name in ("BODY", "HTML") or name in seen[:1]:
            break
        assert outline == "3px", name
        seen.append(name)
    assert seen[:3] == ["pin-a", "pin-b", "click-a"]
    controls = page.value(
        "[...document.querySelectorAll('select, button, input:not([type=radio])')]"
        ".filter(e => e.offsetParent).map(e => e.id || e.getAttribute('aria-label'))"
    )
    assert set(controls) <= set(seen)
    assert {"click-a", "in-stiffness"} <= set(seen)
    unnamed = page.value(
        "[...document.querySelectorAll('select, button, input, svg[role]')].filter(e =>"
        " !(e.labels && e.labels.length) && !e.getAttribute('aria-label') && !e.textContent).length"
    )
    assert unnamed == 0


@pytest.mark.parametrize("width", [1280, 1920])
def test_it_is_readable_at_two_widths(page, width):
    page.resize(width, 1000)
    page.wait(f"document.documentElement.clientWidth === {width}")
    page.wait(
        f"document.querySelector('#parallel svg').getBoundingClientRect().width > {width} - 80"
    )
    assert page.value("document.documentElement.scrollWidth") == width
    sizes = page.value(
        "[...document.querySelectorAll('svg[role]')].map(s => "
        "s.getBoundingClientRect().width / s.viewBox.baseVal.width)"
    )
    assert min(sizes) > 0.97
    overlaps = page.value(
        "[...document.querySelectorAll('#scatter, #panels')].map(e => e.getBoundingClientRect())"
        ".reduce((a, b) => a.right <= b.left)"
    )
    assert overlaps


MANY = 5000


@pytest.fixture
def whole(browser, tmp_path):
    """Open the page of a whole search: 5000 evaluated designs, errors, and another run beside."""
    rng, plain = np.random.default_rng(7), front()
    axes = tuple(
        replace(
            axis,
            values=np.concatenate([axis.values, rng.permuted(np.resize(axis.values, MANY))]),
            errors=np.full(N, 0.1) if axis.kind == "objective" else None,
        )
        for axis in plain.axes
    )
    path = tmp_path / "whole.html"
    page = replace(plain, axes=axes, runs=[0] * (N - 2) + [1] * 2)
    path.write_text(render_interactive(page), encoding="utf-8")
    browser.open(path)
    yield browser
    assert browser.complaints == []
    assert browser.requests == [path.resolve().as_uri()]


def test_all_evaluated_designs_are_brushed_within_half_a_second(whole):
    assert count(whole) == N
    whole.focus("#with-all")
    whole.key(" ")
    whole.value("document.getElementById('matrix').open = true")
    assert count(whole) == N + MANY
    seconds = [
        whole.value(
            "(() => { const begin = performance.now(); brush(axes[0], 20, 150);"
            " document.body.getBoundingClientRect(); return (performance.now() - begin) / 1000;"
            " })()"
        )
        for _ in range(5)
    ]
    assert min(seconds) < 0.5  # the others wait for whatever else the machine does
    first = front().axes[0].values
    inside = np.abs((first - 0.7) / 0.6 * 200 - 85) <= 65 + 1e-6
    assert count(whole) == inside.sum() + np.resize(inside, MANY).sum()
    canvas = "document.querySelector('#matrix-canvas').getContext('2d')"
    assert whole.value(f"{canvas}.getImageData(112, 8, 600, 90).data.some(byte => byte > 0)")


def test_colours_opacity_runs_and_errors_are_shown(whole):
    fills = "[...document.querySelectorAll('#scatter circle')].map(c => c.getAttribute('fill'))"
    assert whole.value(f"{fills}.slice(0, {N})") == ["#0b4f7d"] * (N - 2) + ["#d55e00"] * 2
    assert "beside: design 9" in whole.text("#key")
    bars = "document.querySelectorAll('#scatter line[stroke=\"#9aa5b1\"]').length"
    assert whole.value(bars) == 2 * N
    whole.focus("#colour")
    whole.key("ArrowDown")
    assert len(set(whole.value(f"{fills}.slice(0, {N})"))) == N
    whole.focus("#opacity")
    whole.key("End")
    assert whole.value("document.querySelectorAll('#parallel path[opacity=\"1\"]').length") > 0


def test_axes_are_moved_by_their_names_and_from_a_list(whole):
    names = "shownAxes().slice(0, 3).map(axis => axis.name)"
    assert whole.value(names) == ["Front x", "Front y", "Front z"]
    x, top, _ = axis_place(whole, 0)
    second, *_ = axis_place(whole, 1)
    whole.drag((x, top - 40), (x + 10, top - 40), (second + 3, top - 40))
    assert whole.value(names) == ["Front y", "Front x", "Front z"]
    whole.focus("#leading")
    whole.key("End")
    whole.value("document.getElementById('with-vehicles').click()")
    assert whole.value(names)[1:] == ["Front y", "Front x"]


def test_the_run_up_of_a_design_sounds_as_loud_as_its_levels_say(whole):
    whole.value(
        "(() => { const context = new OfflineAudioContext(1, 32000, 8000); window.heard = null;"
        " runUp(context, 3, 1, 4); context.startRendering().then("
        "sound => { window.heard = [...sound.getChannelData(0)]; }); })()"
    )
    whole.wait("window.heard !== null")
    heard = np.array(whole.value("window.heard"))
    given = front()
    lines, levels = given.frequency, given.levels
    pascal = np.sqrt(2) * 20e-6 * 10 ** ((levels - a_weighting(lines)) / 20)
    sweep = np.linspace(lines[0], lines[-1], heard.size)
    wanted = np.interp(sweep, lines, pascal[4, 1]) / given.full_scale
    middle, window = slice(3200, 28800), np.ones(3200) / 3200
    loud = np.sqrt(np.convolve(heard**2, window, "same")[middle] * 2)
    smooth = np.sqrt(np.convolve(wanted**2, window, "same")[middle])
    np.testing.assert_allclose(loud, smooth, atol=0.03 * smooth.max() + 1e-3)
    assert f"{given.full_scale:.3g} Pa" in whole.text("#scale")


def test_without_scripts_the_pictures_of_the_run_are_there(browser, path):
    browser.scripts(allowed=False)
    try:
        browser.open(path)
        assert "needs JavaScript" in browser.text("noscript")
        assert browser.value("document.querySelector('noscript img').naturalWidth") > 100
        assert browser.value("document.getElementById('explorer').offsetParent === null")
    finally:
        browser.scripts(allowed=True)


def test_the_page_is_one_file_and_holds_every_number():
    given = front()
    html = render_interactive(given)
    assert not re.search(r"(?:src|href)\s*=\s*[\"'](?!data:)", html)
    assert "<b>Cabrio" not in html
    assert "Explore &lt;me&gt;" in html
    data = data_of(html)
    assert [vehicle["name"] for vehicle in data["vehicles"]] == list(VEHICLES)
    stored = np.frombuffer(base64.b64decode(data["levels"]), "<i2")
    np.testing.assert_allclose(
        stored.reshape(given.levels.shape) * data["levelStep"], given.levels, atol=0.00501
    )
    for axis, kept in zip(given.axes, data["axes"], strict=True):
        np.testing.assert_allclose(kept["values"], axis.values, rtol=1e-6)
    assert data["axes"][1]["stiffness"] is None


def test_a_large_front_is_thinned_evenly_keeps_its_picks_and_says_so():
    given = front(n=1500, lines=np.linspace(20.0, 60.0, 400), vehicles=("a", "b", "c", "d"))
    picks = [""] * 1500
    picks[1], picks[1498] = "best-mean", "knee"
    html = render_interactive(replace(given, picks=picks))
    data = data_of(html)
    assert 5_500_000 < len(html.encode()) <= interactive.MAX_BYTES == 6_000_000
    assert {"best-mean", "knee"} <= set(data["picks"])
    shown = len(data["points"])
    assert f"{shown} of the 1500 designs are shown" in html
    assert max(np.diff(data["points"])) <= 2
    assert len(data["levels"]) == -(-2 * (shown + 1) * 4 * 400 // 3) * 4


def test_doubled_axes_and_what_is_not_finite_are_refused():
    axes = front().axes
    with pytest.raises(InputError, match=r"doubled axes \['Front x'\]"):
        front(axes=(axes[0], *axes))
    with pytest.raises(InputError, match="'σ' has a value that is not finite"):
        front(axes=[replace(a, today=np.inf) if a.name == "σ" else a for a in axes])
    with pytest.raises(InputError, match="'σ' has a value that is not finite"):
        front(axes=[replace(a, values=a.values * [np.nan, *[1] * 8]) for a in axes[-3:]])
    for level in (np.nan, 301.0, -301.0):
        with pytest.raises(InputError, match="a level of the front is not finite or beyond ±300"):
            front(levels=np.array([50.0, level, 60.0]))


def test_a_page_shows_as_many_designs_as_there_is_room_for(monkeypatch):
    whole = front(n=200, pictures=(Picture(bytes(300), "", ""),))
    tried = [replace(axis, values=np.resize(axis.values, 210)) for axis in whole.axes]
    whole = replace(whole, axes=tuple(tried))
    # 13 axes, 2 vehicles, 7 lines, 10 designs without curves; 12 bytes per number, 8/3 per level
    program_and_picture, once = 120_000 + 400, 12 * (2 * 7 + 10 * 13)
    each = 8 / 3 * 14 + 12 * 13 + 4 * 12
    room = int(np.ceil(program_and_picture + once + 51 * each))
    for size, most in ((room, 50), (room - 1, 49)):
        monkeypatch.setattr(interactive, "MAX_BYTES", size)
        assert len(interactive._shown(whole)) == most - 2  # both picks are among the evenly chosen


def test_an_axis_reaches_over_its_values_and_has_a_length():
    alone = {(2.0, 5.0): (2.0, 5.0), (-4.0,): (-4.004, -3.996), (0.0,): (-1e-6, 1e-6)}
    for values, ends in alone.items():
        assert interactive._reach(np.array(values), values[0]) == pytest.approx(ends, rel=1e-12)


def test_a_front_without_room_for_a_design_is_refused():
    with pytest.raises(InputError, match="no room for a design"):
        render_interactive(front(n=2, lines=np.linspace(1, 2, 1_100_000), vehicles=("a",)))
