"""Files that other programs wrote: each is read, or refused with the reason."""

from pathlib import Path

import numpy as np
import pytest

from deboom.errors import InputError
from deboom.files.time_data import read_time_signals
from deboom.files.uff import read_uff
from deboom.files.units import parse_unit

DATA = Path(__file__).parents[1] / "data"
VENDOR = DATA / "pyuff-vendor-files"
RULER = DATA / "pydvma-ruler"
LABVIEW = DATA / "lvm-labview"


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
    assert (frf.ordinate_unit, frf.file_unit) == ("m/s^2/N", "(1/N)*(m/s²)")


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


def test_labview_without_instants_keeps_units_and_channels_together():
    """Each row begins with the empty cell of X_Value, and numbers have decimal commas."""
    force, response = read_time_signals(
        LABVIEW / "short.lvm", ["Excitation (Trigger)", "Response (Trigger)"]
    ).values()
    assert (force.unit, response.unit) == ("Newtons", "m/s^2")
    assert force.values[[0, 1, -1]] == pytest.approx([0.914018, 0.537321, 0.680572])
    assert response.values[[0, 1, -1]] == pytest.approx([1.204792, 1.208403, 1.212775])
    assert force.time == pytest.approx(np.arange(10) / 25600)
    assert parse_unit(force.unit).si == "N"


def test_labview_with_instants_of_every_channel_keeps_units_and_channels_together(tmp_path):
    read = read_time_signals(LABVIEW / "no_decimal_separator.lvm", ["az", "ax"])
    assert {signal.unit for signal in read.values()} == {"g"}
    assert read["ax"].values == pytest.approx([-0.008807, -0.025979, -0.011987, 0.059248])
    assert read["az"].values == pytest.approx([0.021503, -0.005606, 0.007789, -0.009433])
    assert read["az"].time == pytest.approx([0.0, 2.5e-4, 5e-4, 7.5e-4])
    # a file of 51 200 samples, of which its publisher kept three
    text = (LABVIEW / "multi_time_column.lvm").read_text()
    (tmp_path / "whole.lvm").write_text(text.replace("51200", "3"))
    volts, shaken = read_time_signals(tmp_path / "whole.lvm", ["Voltage", "Acceleration"]).values()
    assert (volts.unit, shaken.unit) == ("Volts", "g")
    assert volts.values == pytest.approx([-0.035229, -0.034882, -0.034191])
    assert shaken.values == pytest.approx([0.532608, 0.502991, 0.467541])
    assert shaken.time == pytest.approx(np.arange(3) / 51200, abs=1e-15)


def test_labview_with_notes_comments_and_empty_channels(tmp_path):
    text = (LABVIEW / "with_empty_fields.lvm").read_text().replace("\t100", "\t7")
    (tmp_path / "whole.lvm").write_text(text)
    names = ["Dev0/Ai0", "Dev0/Ai2", "Dev0/Ai0 1"]
    first, second, third = read_time_signals(tmp_path / "whole.lvm", names).values()
    assert second.values[:3] == pytest.approx([7.254639, 7.254639, 7.250977])
    np.testing.assert_array_equal(first.values, third.values)
    assert third.time == pytest.approx(np.arange(7) * 1e-3)
    with pytest.raises(InputError, match="'Untitled 2' has 0 samples by its header and 0 in the"):
        read_time_signals(tmp_path / "whole.lvm", ["Untitled 2"])
    logged = read_time_signals(
        LABVIEW / "with_comments.lvm", ["Pressão ABS. (MPa)", "Temperatura (°C)", "Volume (ml)"]
    )
    assert [signal.unit for signal in logged.values()] == ["MPa", "°C", "ml"]
    pressure = logged["Pressão ABS. (MPa)"]
    assert pressure.values[[0, -1]] == pytest.approx([1.833787, 1.717152])
    # logged by hand: no even steps, whatever Delta_X of the header says
    assert pressure.time[[1, -1]] == pytest.approx([0.328878, 9.723275])


@pytest.mark.parametrize(
    ("name", "channel", "stated", "n_written"),
    [
        ("multi_time_column.lvm", "Acceleration", 51200, 3),
        ("with_empty_fields.lvm", "Dev0/Ai2", 100, 7),
    ],
)
def test_a_labview_file_that_was_cut_is_refused(name, channel, stated, n_written):
    words = f"'{channel}' has {stated} samples by its header and {n_written} in the file: copy"
    with pytest.raises(InputError, match=words):
        read_time_signals(LABVIEW / name, [channel])


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
