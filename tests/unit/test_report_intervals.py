"""Figures of intervals: what they draw, and what they refuse."""

import numpy as np
import pytest

from deboom.errors import InputError
from deboom.report.figures import IntervalPanel, front_intervals, interval_panels

PNG = b"\x89PNG\r\n\x1a\n"
BOUNDS = ([1.0, 2.0], [0.5, 1.5], [1.5, 2.6])


def test_rows_of_several_panels_and_a_front_are_drawn():
    panels = [
        IntervalPanel("level [dB(A)]", {"today's": BOUNDS}),
        IntervalPanel("change [dB]", {"best mean": BOUNDS, "knee": BOUNDS}, "against today's"),
    ]
    drawn = interval_panels(["V-1", "V-2"], panels)
    assert drawn.startswith(PNG)
    assert drawn == interval_panels(["V-1", "V-2"], panels)
    front = front_intervals(BOUNDS, BOUNDS, {"knee": 1}, mean_label="a [dB]", sigma_label="b [dB]")
    assert front.startswith(PNG)


def test_what_cannot_be_drawn_is_refused():
    with pytest.raises(InputError, match="no panel"):
        interval_panels(["V-1"], [])
    with pytest.raises(InputError, match="different lengths"):
        interval_panels(["V-1"], [IntervalPanel("x [dB]", {"a": BOUNDS})])
    broken = ([1.0, np.nan], *BOUNDS[1:])
    with pytest.raises(InputError, match="mean value is not finite"):
        front_intervals(broken, BOUNDS, {}, mean_label="a [dB]", sigma_label="b [dB]")
