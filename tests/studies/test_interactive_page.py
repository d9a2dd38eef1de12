"""The interactive page: one file that is safe against any name and small for any front."""

import base64
import re
from dataclasses import replace

import numpy as np
import pytest
from interactive_front_samples import LINES, VEHICLES, N, data_of, front

from deboom.errors import InputError
from deboom.report import interactive
from deboom.report.interactive import render_interactive


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
    picks[1], picks[1498] = "best mean", "knee"
    html = render_interactive(replace(given, picks=picks))
    data = data_of(html)
    assert 5_500_000 < len(html.encode()) <= interactive.MAX_BYTES == 6_000_000
    assert {"best mean", "knee"} <= set(data["picks"])
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
    with pytest.raises(InputError, match="a level of the front is not finite"):
        front(levels=np.full((N + 1, 2, len(LINES)), np.nan))


def test_a_front_without_room_for_a_design_is_refused():
    with pytest.raises(InputError, match="no room for a design"):
        render_interactive(front(n=2, lines=np.linspace(1, 2, 1_100_000), vehicles=("a",)))
