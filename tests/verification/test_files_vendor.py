"""Files that other programs wrote: each is read, or refused with the reason."""

from pathlib import Path

import numpy as np
import pytest

from deboom.errors import InputError
from deboom.files.uff import read_uff

DATA = Path(__file__).parents[1] / "data"
VENDOR = DATA / "pyuff-vendor-files"
RULER = DATA / "pydvma-ruler"


def test_ascii_and_binary_export_of_one_recording_agree():
    (ascii_record,) = read_uff(VENDOR / "Sample_UFF58_ascii.uff")
    (binary_record,) = read_uff(VENDOR / "Sample_UFF58b_bin.uff")
    for record in (ascii_record, binary_record):
        assert record.values.shape == (79292,)
        assert np.max(np.abs(record.values)) == pytest.approx(0.141304, abs=5e-7)
        assert (record.unit, record.abscissa_quantity, record.function_type) == ("Pa", "time", 1)
        assert (record.response_name, record.id_lines[0]) == ("Mic 01", "Mic 01.0Scalar")
        assert record.abscissa[-1] == pytest.approx(79291 * 1.52588e-5, rel=1e-12)
    # the ASCII file keeps 6 digits
    np.testing.assert_allclose(ascii_record.values, binary_record.values, rtol=5.1e-6, atol=1e-12)


def test_a_power_spectral_density_with_uneven_abscissa_is_read():
    (psd,) = read_uff(VENDOR / "sample_dataset58_psd.uff")
    assert psd.function_type == 9
    assert psd.abscissa_quantity == "frequency"
    np.testing.assert_array_equal(psd.abscissa, np.arange(3201.0))
    assert psd.values[5].real == pytest.approx(1.214505e-4, rel=1e-6)
    # the label g²/Hz is not UTF-8 in this file: kept as it is, never read as SI
    assert psd.ordinate_unit.startswith("g")
    assert psd.ordinate_unit.endswith("/Hz")


def test_a_last_row_that_is_half_filled_is_read():
    (record,) = read_uff(VENDOR / "time-history-not-all-columns-filled.uff")
    assert record.values.shape == (13,)
    assert (record.unit, record.file_unit) == ("m/s^2", "m/s²")
    assert record.values[0] == pytest.approx(-3.81956)


def test_a_header_that_is_not_utf8_is_read():
    (frf,) = read_uff(VENDOR / "non_ascii_header.uff")
    assert (frf.function_type, frf.values.shape) == (4, (6,))
    assert frf.values[1] == pytest.approx(-5.99924e-02 - 5.53260e-02j)
    assert frf.ordinate_unit.startswith("(1/N)*(m/s")


def test_a_file_that_holds_less_than_it_announces_is_refused():
    with pytest.raises(InputError, match="2508876 values are announced and 42 are there"):
        read_uff(VENDOR / "dataset_milestone_in_header.uff")


@pytest.mark.parametrize(
    ("name", "types"),
    [
        ("Artemis_export_-_Geometry_RPBC_setup_05_14102016_105117.uff", "15, 82, 82, 2412"),
        ("TestLab_161_164_18_15_82.uff", "151, 164, 18, 15, 82, 82, 82"),
        ("mesh_Oros-modal_uff15_uff2412.uff", "18, 15, 2412"),
        ("uff55_translation_rotation.uff", "55"),
    ],
)
def test_a_file_without_functions_is_refused_and_its_sets_are_listed(name, types):
    words = rf"{name} holds no function \(data set 58\), only sets {types}$"
    with pytest.raises(InputError, match=words):
        read_uff(VENDOR / name)


def test_every_vendor_file_has_a_test_here():
    text = Path(__file__).read_text(encoding="utf-8")
    assert [path.name for path in VENDOR.glob("*.uff") if path.name not in text] == []


def test_a_measured_frf_is_the_same_from_uff_and_from_arrays():
    with np.load(RULER / "ruler_two_lines_0-2kHz.npz", allow_pickle=False) as arrays:
        frequency, frf = arrays["freq_hz"], arrays["tf"]
    functions = read_uff(RULER / "ruler_two_lines_0-2kHz.uff")
    assert len(functions) == frf.shape[1] == 2
    for grid_line, function in enumerate(functions):
        assert (function.reference_node, function.reference_direction) == (grid_line + 1, "+z")
        assert function.unit == ""
        np.testing.assert_allclose(function.values, frf[:, grid_line], rtol=1e-7)
        # the step 0.6103516 Hz is stored as 0.610352: the drift that write_uff warns of
        np.testing.assert_allclose(function.abscissa, frequency, atol=2e-3)
