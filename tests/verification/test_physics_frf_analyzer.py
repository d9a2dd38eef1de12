"""Spectra, H1 and coherence that a laboratory's analyzer exported, measured in 2014.

The export mixes kinds: auto spectra per hertz, the cross spectrum as power.
"""

from pathlib import Path

import numpy as np
import pytest

from deboom.errors import InputError
from deboom.measurement.channels import Frf
from deboom.measurement.coherence_gate import imported_estimate, require_coherence
from deboom.physics.cross_spectra import CrossSpectra, SpectrumScaling, cross_spectra
from deboom.physics.frf_estimators import coherence, h1, h2, hv

DATA = Path(__file__).parents[1] / "data" / "vibrationtesting-analyzer"
BAND = slice(5, 1600)
"""Without what the analyzer's AC coupling does to the first lines."""


@pytest.fixture(scope="module", params=["case1", "case2"])
def export(request):
    with np.load(DATA / f"{request.param}.npz", allow_pickle=False) as file:
        return {name: np.asarray(file[name], dtype=file[name].dtype) for name in file.files}


def spectra(export, line_spacing):
    cross = export["Hf_Cross_Spec_chan_2"][:, np.newaxis, np.newaxis]
    auto = [
        export[f"PSD_chan_{i}"].astype(float)[:, np.newaxis, np.newaxis] * line_spacing
        for i in (1, 2)
    ]
    lines = export["Freq_domain"].astype(float)
    # the number of averages is not exported; two are enough to have a coherence
    return CrossSpectra(lines, auto[0], cross, auto[1], 2)


def test_h1_of_the_analyzer(export):
    found = h1(spectra(export, float(export["PSD_DeltaF"])))[BAND, 0, 0]
    assert np.abs(found / export["Hf_chan_2"][BAND] - 1).max() < 1e-6


def test_coherence_of_the_analyzer(export):
    measured = spectra(export, float(export["PSD_DeltaF"]))
    possible = (export["Hf_coh_chan_2"] <= 1) & (np.arange(1601) >= 5) & (np.arange(1601) < 1600)
    assert possible.sum() >= 1591
    found = coherence(measured.on_lines(possible))[:, 0, 0]
    assert np.abs(found - export["Hf_coh_chan_2"][possible]).max() < 1e-6


def test_the_analyzer_prints_coherences_above_1():
    """Up to 1.05 in case 1: its auto and cross spectra are not of one average. Named, not cut."""
    with np.load(DATA / "case1.npz", allow_pickle=False) as file:
        export = dict(file)
    above = np.flatnonzero(export["Hf_coh_chan_2"] > 1)
    assert list(above) == [0, 11, 13, 28, 57]
    measured = spectra(export, float(export["PSD_DeltaF"]))
    with pytest.raises(InputError, match="Hz is above 1: auto and cross spectra"):
        coherence(measured.on_lines(np.arange(1601) >= 5))
    identity = np.abs(measured.output_input) ** 2 / (measured.input_auto * measured.output_auto)
    np.testing.assert_allclose(identity[above, 0, 0].real, export["Hf_coh_chan_2"][above], 1e-6)


def test_the_trap_of_the_line_spacing(export):
    """Density taken for power: H1 errs by 1/df = 3.2, coherence by 1/df² = 10.24."""
    spacing = float(export["PSD_DeltaF"])
    assert spacing == 0.3125
    mixed = spectra(export, 1.0)
    wrong = h1(mixed)[BAND, 0, 0]
    assert np.abs(wrong / export["Hf_chan_2"][BAND] * 3.2 - 1).max() < 1e-6
    claimed = np.abs(mixed.output_input) ** 2 / (mixed.input_auto * mixed.output_auto)
    true = export["Hf_coh_chan_2"][BAND]
    assert np.abs(claimed[BAND, 0, 0].real * 10.24 / true - 1).max() < 1e-5


def test_one_kind_of_spectrum_cannot_fall_into_it(export):
    """From time data, H1 is the same in every scaling; powers differ by df, as they must."""
    first, second = (export[f"Time_chan_{i}"].astype(float) for i in (1, 2))
    first, second = (x.reshape(4, 1024)[:, :, np.newaxis] for x in (first, second))
    rate = float(export["Time_Sample_Rate"])
    each = {s: cross_spectra(first, second, rate, scaling=s) for s in SpectrumScaling}
    power = each[SpectrumScaling.POWER]
    density = each[SpectrumScaling.POWER_DENSITY]
    np.testing.assert_allclose(power.input_auto, density.input_auto * rate / 1024, rtol=1e-12)
    for other in each.values():
        np.testing.assert_allclose(h1(other)[1:], h1(power)[1:], rtol=1e-10)
    # Parseval: the sum over the lines is the mean square of the record
    assert power.input_power.sum() == pytest.approx(np.mean(first**2), rel=1e-12)


def test_h2_and_hv_follow_from_the_coherence(export):
    """H1/H2 = γ², and Hv lies in the geometric middle, with one phase."""
    measured = spectra(export, float(export["PSD_DeltaF"]))
    gamma2 = export["Hf_coh_chan_2"][BAND, np.newaxis, np.newaxis].astype(float)
    part = measured.on_lines(np.arange(len(measured.frequency)) >= 5).on_lines(
        np.arange(1596) < 1595
    )
    np.testing.assert_allclose(h1(part) / h2(part), gamma2, rtol=2e-5)
    np.testing.assert_allclose(hv(part), h1(part) / np.sqrt(gamma2), rtol=2e-5)


def test_nothing_is_identified_from_it(export):
    values = export["Hf_chan_2"][:, np.newaxis, np.newaxis]
    gamma2 = export["Hf_coh_chan_2"].astype(float)[:, np.newaxis, np.newaxis]
    assert gamma2.mean() == pytest.approx(0.34, abs=0.01)
    possible = gamma2[:, 0, 0] <= 1
    frf = Frf(export["Freq_domain"][possible], values[possible], ("out",), ("in",), "V/V")
    estimate = imported_estimate(frf, gamma2[possible])
    # the line at 0 Hz is not part of it
    assert estimate.frequency[0] == 0.3125
    with pytest.raises(InputError, match=r"'out' to input 'in': median coherence 0\.3\d from 5 to"):
        require_coherence(estimate, (5.0, 400.0))
    with pytest.raises(InputError, match="has no coherence"):
        require_coherence(imported_estimate(frf), (5.0, 400.0))
    # the figure is the reason, not the data set
    require_coherence(estimate, (5.0, 400.0), smallest=0.1)
