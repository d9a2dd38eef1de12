"""Weightings for people, against the tables of the standards."""

import numpy as np
import pytest

from deboom.errors import InputError
from deboom.physics.vibration_level import human_weighting, rms_of_level

NOMINAL = [0.5, 1.0, 2.0, 4.0, 5.0, 6.3, 8.0, 12.5, 16.0, 20.0, 25.0, 31.5, 40.0, 50.0, 63.0, 80.0]
# ISO 2631-1:1997, table 3, in thousandths, without 10 Hz: W_d, exactly 202, is printed as 212 there
WK = [418, 482, 531, 967, 1039, 1054, 1036, 902, 768, 636, 513, 405, 314, 246, 186, 132]
WD = [853, 1011, 890, 512, 409, 323, 253, 161, 125, 100, 80.0, 63.2, 49.4, 38.8, 29.5, 21.1]
# ISO 5349-1:2001, table A.2 (JIS B 7761-3): bands 8 to 31
WH = [0.727, 0.873, 0.951, 0.958, 0.896, 0.782, 0.647, 0.519, 0.411, 0.324, 0.256, 0.202, 0.160]
WH += [0.127, 0.101, 0.0799, 0.0634, 0.0503, 0.0398, 0.0314, 0.0245, 0.0186, 0.0135, 0.00894]


@pytest.mark.parametrize(
    ("name", "frequency", "table"),
    [
        ("Wk", NOMINAL, np.array(WK) / 1000.0),
        ("Wd", NOMINAL, np.array(WD) / 1000.0),
        ("Wh", 10.0 ** (np.arange(8, 32) / 10.0), np.array(WH)),
    ],
)
def test_weightings_meet_the_tables_of_the_standards(name, frequency, table):
    np.testing.assert_allclose(human_weighting(name, frequency), table, rtol=0.007)


def test_a_level_of_its_reference_is_0_db():
    assert rms_of_level([0.0, 100.0], "acceleration").tolist() == [1e-6, pytest.approx(0.1)]
    assert rms_of_level(60.0, "velocity") == pytest.approx(1e-6)


def test_other_weightings_and_lines_are_refused():
    with pytest.raises(InputError, match="no weighting 'Wz': take one of Wk, Wd, Wh"):
        human_weighting("Wz", 8.0)
    with pytest.raises(InputError, match="needs frequencies above 0 Hz"):
        human_weighting("Wk", [0.0, 8.0])
