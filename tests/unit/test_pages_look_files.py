"""A look at files lays functions over each other, and shows what signals over time contain."""

import numpy as np
import pandas as pd
import pytest
from scipy.io import wavfile

from command_line import call
from deboom.errors import InputError
from deboom.files.curves import CurveKind, read_curves
from deboom.files.uff import UffFunction, write_uff
from deboom.pages.look_files import look_files_report

LINES = np.arange(5.0, 55.0)


def function(response, reference, values, **other):
    return UffFunction(
        LINES,
        values,
        4,
        *response,
        *reference,
        ordinate="acceleration",
        ordinate_unit="m/s^2",
        denominator="force",
        denominator_unit="N",
        **other,
    )


def accelerance(damping=0.02):
    return -(LINES**2) / (30.0**2 - LINES**2 + 60j * damping * LINES)


def pair(gain=1.0):
    """Two functions of a structure, with a response along −x, and a coherence of one of them."""
    there = function((1, "-x"), (2, "+z"), -accelerance())
    back = function((2, "+z"), (1, "+x"), gain * accelerance())
    coherence = UffFunction(LINES, np.full(LINES.size, 0.5), 6, 1, "-x", 2, "+z", ordinate_unit="1")
    return there, back, coherence


def test_reciprocal_functions_are_the_same_whatever_the_signs_of_axes(tmp_path):
    write_uff(tmp_path / "a.uff", pair())
    write_uff(tmp_path / "b.uff", pair(gain=-1.5))
    report = look_files_report([tmp_path / "a.uff", tmp_path / "b.uff"], "", 1)
    same, apart = (report.tables[f"reciprocity_{name}.uff"]["value [1]"] for name in "ab")
    assert same[0] == pytest.approx(1.0, abs=1e-6)
    assert apart[0] == pytest.approx((1 - 1.5) ** 2 / (2 * (1 + 1.5**2)), rel=1e-5)
    (difference,) = report.tables["differences"].query("function.str.startswith('node 2')")[
        "median of its magnitude [dB]"
    ]
    assert difference == pytest.approx(20 * np.log10(1.5), abs=1e-5)
    text = " ".join((report.verdict, *report.remarks))
    assert "4 functions and 2 coherences" in text
    assert "1 of 1 coherences of a.uff stay below 0.9" in text
    assert "1 of 1 reciprocal pairs of b.uff are below 0.75, least 1 x and 2 z (0.04)" in text


RATE, ORDER, FIRST, LAST = 1024.0, 2.0, 1200.0, 1800.0


def run_up(path):
    """Write a run-up of 8 s with order 2 of 3 m/s² rms and a pulse per revolution."""
    time = np.arange(8 * int(RATE)) / RATE
    revolution = FIRST / 60 * time + (LAST - FIRST) / 60 * time**2 / (2 * 8.0)
    table = pd.DataFrame(
        {
            "time [s]": time,
            "A1 x [m/s^2]": np.sqrt(2) * 3.0 * np.sin(2 * np.pi * ORDER * revolution),
            "tacho [V]": np.where(revolution % 1 < 0.2, 5.0, 0.0),
        }
    )
    table.to_csv(path, index=False)
    return path


def test_a_run_up_with_its_tacho_has_orders_and_third_octaves(tmp_path):
    report = look_files_report([run_up(tmp_path / "run.csv")], "tacho", 1)
    orders = report.tables["orders_run.csv"].set_index("order [1]")
    assert orders.loc[ORDER, "rms"] == pytest.approx(3.0, rel=0.01)
    assert orders.drop(ORDER)["rms"].max() < 0.05
    bands = report.tables["third_octaves_run.csv"].iloc[0, 2:].astype(float)
    assert 10 * np.log10(np.sum(10 ** (bands / 10))) == pytest.approx(20 * np.log10(3), abs=0.1)
    assert "campbell_run.csv" in report.pictures
    assert "waterfall_run.csv" in look_files_report([tmp_path / "run.csv"], "", 1).pictures


def test_what_cannot_be_looked_at_is_refused(tmp_path):
    run = run_up(tmp_path / "run.csv")
    with pytest.raises(InputError, match="no file has a channel 'speed'"):
        look_files_report([run], "speed", 1)
    (tmp_path / "other").mkdir()
    again = run_up(tmp_path / "other/run.csv")
    with pytest.raises(InputError, match=r"two files have the name 'run\.csv'"):
        look_files_report([run, again], "", 1)
    assert "look at one folder, or at files" in call("look", run, tmp_path, code=2).stderr
    assert "--tacho is for files" in call("look", tmp_path, "--tacho", "n", code=2).stderr


def test_a_recording_of_sound_is_told_how_loud_it_is(tmp_path):
    """The definition of the sone: a tone of 1 kHz at 40 dB; twice as loud 10 dB above."""
    pytest.importorskip("mosqito")
    time = np.arange(48_000) / 48_000
    for name, level in (("quiet", 40.0), ("loud", 50.0)):
        tone = np.sqrt(2) * 2e-5 * 10 ** (level / 20) * np.sin(2 * np.pi * 1000 * time)
        wavfile.write(tmp_path / f"{name}.wav", 48_000, tone.astype(np.float32))
        (tmp_path / f"{name}.csv").write_text("channel,full_scale,unit\near,1,Pa\n")
    report = look_files_report([tmp_path / "quiet.wav", tmp_path / "loud.wav"], "", 1)
    quiet, loud = report.tables["loudness"]["loudness N5 [sone]"]
    assert quiet == pytest.approx(1.0, rel=0.03)
    assert loud == pytest.approx(2.0, rel=0.05)
    assert "ear of loud.wav has 2.0 sone, ear of quiet.wav 1.0" in " ".join(
        (report.verdict, *report.remarks)
    )


def test_curves_of_every_format_have_name_unit_and_kind(tmp_path):
    write_uff(tmp_path / "a.uff", pair())
    kinds = [curve.kind for curve in read_curves(tmp_path / "a.uff")]
    assert kinds == [CurveKind.function, CurveKind.function, CurveKind.coherence]
    frame = pd.DataFrame({"frequency [Hz]": LINES, "H real [mm]": LINES, "H imag [mm]": 0 * LINES})
    frame.to_csv(tmp_path / "f.csv", index=False)
    (curve,) = read_curves(tmp_path / "f.csv")
    assert (curve.name, curve.unit) == ("H", "m")
    np.testing.assert_allclose(curve.values, 1e-3 * LINES)
    signals = read_curves(run_up(tmp_path / "run.csv"))
    assert [(s.name, s.unit, s.kind) for s in signals] == [
        ("A1 x", "m/s^2", CurveKind.signal),
        ("tacho", "V", CurveKind.signal),
    ]
