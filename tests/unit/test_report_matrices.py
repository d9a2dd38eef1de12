"""Figures over frequency, matrices and bars: pictures of the right data, refusals of the wrong."""

import numpy as np
import pytest

from deboom.errors import InputError
from deboom.report.figures import (
    HeatMap,
    SpectrumPanel,
    curve_matrix,
    heat_maps,
    ratio_bars,
    spectra_panels,
)

LINES = np.geomspace(10.0, 150.0, 30)
PNG = b"\x89PNG"


def panel(**changes):
    curve = {"measured": 1 / LINES, "identified": 1 / LINES}
    fields = {
        "title": "inertance",
        "y_label": "[1/kg]",
        "frequency": LINES,
        "curves": curve,
        "ranges": {"95 %": (0.9 / LINES, 1.1 / LINES)},
        "levels": {"450": 0.05},
        "logarithmic": True,
    }
    return SpectrumPanel(**(fields | changes))


def test_spectra_are_drawn_alike_twice():
    drawn = [
        spectra_panels([panel()], columns=1, dashed=("identified",), fitted=((10.0, 30.0),))
        for _ in range(2)
    ]
    assert drawn[0] == drawn[1]
    assert drawn[0].startswith(PNG)


def test_a_matrix_of_curves():
    values = np.ones((LINES.size, 2, 2)) * LINES[:, np.newaxis, np.newaxis]
    for logarithmic in (False, True):
        picture = curve_matrix(
            ("Tx", "Rx"),
            LINES,
            {"measured": values, "identified": 2 * values},
            units=("kg", "kg m", "kg m²"),
            what="apparent mass",
            dashed=("identified",),
            fitted=((10.0, 30.0),),
            logarithmic=logarithmic,
        )
        assert picture.startswith(PNG)


def test_heat_maps_and_bars():
    one = HeatMap("MAC", ("1", "2"), ("1", "2"), np.eye(2), "measured", "identified")
    assert heat_maps([one, one, one, one]).startswith(PNG)
    bars = ratio_bars(
        ("a", "b", "c"), (0.1, 0.9, 0.3), limit=0.5, x_label="[1]", below="seen", above="not"
    )
    assert bars.startswith(PNG)


def test_refusals():
    with pytest.raises(InputError, match="no panel"):
        spectra_panels([])
    with pytest.raises(InputError, match="not finite"):
        spectra_panels([panel(curves={"measured": np.full(LINES.size, np.nan)})])
    with pytest.raises(InputError, match="different lengths"):
        spectra_panels([panel(curves={"measured": LINES[:-1]})])
    with pytest.raises(InputError, match="has shape"):
        curve_matrix(("Tx",), LINES, {"a": np.ones((LINES.size, 2, 2))}, units=("",) * 3, what="")
    with pytest.raises(InputError, match="no matrix"):
        heat_maps([])
    with pytest.raises(InputError, match="has shape"):
        heat_maps([HeatMap("MAC", ("1",), ("1",), np.eye(2))])
    with pytest.raises(InputError, match="different lengths"):
        ratio_bars(("a",), (0.1, 0.2), limit=0.5, x_label="", below="", above="")
