"""Views of signals over time that identify nothing: Campbell, cuts of orders, third octaves."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.ndimage import uniform_filter1d
from scipy.signal import ShortTimeFFT, get_window, welch

from deboom.arrays import RealArray, checked
from deboom.errors import InputError
from deboom.measurement.channels import TimeRecord
from deboom.measurement.order_tracking import TrackingOptions, settled_lines, vold_kalman_spectra
from deboom.measurement.tacho import ShaftAngle
from deboom.physics.order_tracking import LEAST_SAMPLES_PER_PERIOD, frequency_of_order

CAMPBELL_SECONDS = 0.5
"""Window of a Campbell diagram: its lines are 2 Hz apart [s]."""
CAMPBELL_ROWS = 80
"""Instants of a Campbell diagram."""
HALF_ORDERS = tuple(0.5 * n for n in range(1, 13))
"""Orders of a four-stroke engine whose cuts are drawn, up to 6 [1]."""
CUT_BANDWIDTH = 3.0
"""Half-power width of the filter about each order [Hz]."""
CUT_STEP = 20.0
"""Distance of the lines of a cut [1/min]."""
LINES_PER_BAND = 4
"""Lines of the spectrum that the narrowest third octave must have."""
_NOMINAL = (10.0, 12.5, 16.0, 20.0, 25.0, 31.5, 40.0, 50.0, 63.0, 80.0)


@dataclass(frozen=True, eq=False)
class Campbell:
    """Short-time spectrum of a record, all channels together.

    - `frequency` (n_line,) [Hz]; `time` (n_row,): middle of each window [s].
    - `rms` (n_line, n_row): root mean square over the channels of the rms of each line [unit].
    """

    frequency: RealArray
    time: RealArray
    rms: RealArray


def campbell(record: TimeRecord, highest: float) -> Campbell:
    """Return the short-time spectrum of a record, with Hann windows of `CAMPBELL_SECONDS`.

    A tone between two lines shows up to 1.4 dB too low, and one whose frequency moves by more than
    2 Hz within a window is spread.

    - `highest`: last line [Hz].
    - raises InputError: a record shorter than two windows.
    """
    samples = max(int(record.rate * CAMPBELL_SECONDS), 16)
    count = len(record.values)
    if count < 2 * samples:
        raise InputError(
            f"a record of {count / record.rate:.2f} s is too short for a Campbell diagram: it "
            f"needs {2 * samples / record.rate:.2g} s"
        )
    hop = max((count - samples) // CAMPBELL_ROWS, 1)
    transform = ShortTimeFFT(get_window("hann", samples), hop, record.rate, scale_to="magnitude")
    first, last = transform.lower_border_end[1], transform.upper_border_begin(count)[1]
    last = max(last, first + 1)
    lines = transform.f <= highest
    power = np.zeros((int(lines.sum()), last - first))
    for channel in record.values.T:
        amplitude = 2 * np.abs(transform.stft(channel, p0=first, p1=last)[lines])
        power += amplitude**2 / 2
    time = record.start + transform.t(count, p0=first, p1=last)
    return Campbell(transform.f[lines], time, np.sqrt(power / record.values.shape[1]))


@checked(rpm="f", rms="f o", everything="f")
class OrderCuts:
    """Orders of a run over engine speed, all channels together.

    - `rpm` (n_line,) [1/min]; `orders` (n_order,) [1].
    - `rms` (n_line, n_order): root mean square over the channels of each order's rms [unit].
    - `everything` (n_line,): the same of all that was recorded, half a second about each line.
    """

    rpm: RealArray
    orders: tuple[float, ...]
    rms: RealArray
    everything: RealArray


def order_cuts(
    record: TimeRecord, shaft: ShaftAngle, orders: Sequence[float] = HALF_ORDERS
) -> OrderCuts:
    """Return cuts of orders through a run, solved together by a Vold-Kalman filter.

    Orders that are sampled too slowly at the highest speed are left out, and half orders where they
    are nearer to each other than the filter is wide at the lowest.

    - `orders`: cycles per revolution, increasing [1].
    - raises InputError: no order is left; a record too short for the filter.
    """
    rpm = settled_lines(shaft, TrackingOptions(bandwidth=CUT_BANDWIDTH, rpm_step=CUT_STEP))
    if frequency_of_order(rpm[0], min(np.diff([0.0, *orders]))) < CUT_BANDWIDTH:
        orders = [order for order in orders if order % 1 == 0]
    highest = record.rate / LEAST_SAMPLES_PER_PERIOD - CUT_BANDWIDTH
    cut = tuple(order for order in orders if order * rpm[-1] / 60 <= highest)
    if not cut:
        raise InputError(
            f"no order can be cut out of a record of {record.rate:g} samples per second at up to "
            f"{rpm[-1]:.0f} 1/min: record it faster"
        )
    spectra = vold_kalman_spectra(record, shaft, cut, rpm, bandwidth=CUT_BANDWIDTH)
    rms = [np.sqrt(np.mean(np.abs(each.spectrum.values) ** 2, axis=1) / 2) for each in spectra]
    power = np.mean((record.values - record.values.mean(axis=0)) ** 2, axis=1)
    mean = uniform_filter1d(power, max(int(record.rate * CAMPBELL_SECONDS), 1))
    instants = record.start + np.arange(len(mean)) / record.rate
    everything = np.sqrt(np.interp(spectra[0].time, instants, mean))
    return OrderCuts(rpm, cut, np.column_stack(rms), everything)


@checked(midband="b", rms="b c")
class ThirdOctaves:
    """Third-octave bands of a record.

    - `nominal`: customary names of the bands [Hz]; `midband` (n_band,): exact middle [Hz].
    - `rms` (n_band, n_channel): root mean square in each band [unit].
    """

    nominal: tuple[float, ...]
    midband: RealArray
    rms: RealArray


def third_octaves(record: TimeRecord, highest: float) -> ThirdOctaves:
    """Return the rms in third-octave bands, from the mean spectrum of the whole record.

    Middles ``1000 · 10^(n/10)`` Hz and edges ``10^(±1/20)`` of them, as in IEC 61260-1 at base
    ten, from 10 Hz on. The bands are cut out of Welch's power spectral density with straight edges:
    no filters of the standard, whose skirts let neighbours in.

    - `highest`: upper edge of the last band [Hz]; at most what the sampling rate carries.
    - raises InputError: a record too short for the lines of a single band.
    """
    count, top = len(record.values), min(highest, record.rate / 2.56)
    n = np.arange(-20, 14)
    midband = 1000 * 10 ** (n / 10)
    resolved = count / record.rate * midband * (10**0.05 - 10**-0.05) >= LINES_PER_BAND
    kept = resolved & (midband * 10**0.05 <= top)
    if not kept.any():
        raise InputError(
            f"a record of {count / record.rate:.2g} s at {record.rate:g} Hz has no third octave "
            f"of {LINES_PER_BAND} lines up to {top:g} Hz: record for longer"
        )
    midband = midband[kept]
    wanted = LINES_PER_BAND / (midband[0] * (10**0.05 - 10**-0.05))
    length = min(count, int(np.ceil(2 * record.rate * wanted)))
    frequency, density = welch(record.values, record.rate, nperseg=length, axis=0)
    step = frequency[1]
    edges = np.append(frequency - step / 2, frequency[-1] + step / 2)
    running = np.vstack([np.zeros(density.shape[1]), np.cumsum(density * step, axis=0)])
    low, high = midband * 10**-0.05, midband * 10**0.05
    power = [np.interp(high, edges, each) - np.interp(low, edges, each) for each in running.T]
    nominal = tuple(_NOMINAL[k % 10] * 10.0 ** (k // 10) for k in n[kept] + 20)
    return ThirdOctaves(nominal, midband, np.sqrt(np.column_stack(power)))
