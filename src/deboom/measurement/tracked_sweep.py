"""From a run-up of a compressor over time to its spectra of first order."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from deboom.arrays import RealArray
from deboom.errors import InputError
from deboom.measurement.channels import Spectrum
from deboom.measurement.order_spectra import vold_kalman_spectra
from deboom.measurement.shaft_angle import ShaftAngle, shaft_angle
from deboom.measurement.tacho import pulse_times
from deboom.measurement.tacho_repair import repair_pulses
from deboom.measurement.time_record import TimeRecord

LINE_STEP = 1.0
"""Between the lines [Hz]."""
BANDWIDTH = 3.0
"""Of the Vold-Kalman filter, full half-power width [Hz]."""
OTHER_ORDERS = (2.0, 3.0)
"""Solved together with the first: pulsation of the gas."""
BESIDE = 1.5
"""A rotor and what it pumps have whole orders: what shows here is noise."""


@dataclass(frozen=True, eq=False)
class TrackedSweep:
    """First order of several records of one run-up.

    Parameters
    ----------
    spectra : tuple of Spectrum
        One per record, on common lines of the rotational frequency; phase from the pulse.
    noise : tuple of array, each of shape (n_channel,)
        Standard deviation of the real and of the imaginary part: what the filter lets through at
        order 1.5, where there is nothing [unit of the record].
    """

    spectra: tuple[Spectrum, ...]
    noise: tuple[RealArray, ...]


def tracked_sweep(tacho: RealArray, records: Sequence[TimeRecord]) -> TrackedSweep:
    """Track the first order of a run-up or run-down with one tacho pulse per revolution.

    Parameters
    ----------
    tacho : array, shape (n_sample,)
        On the samples of the records; the rising edge marks the angle.
    records : sequence of TimeRecord
        Of one rate.

    Returns
    -------
    TrackedSweep
        Lines at whole multiples of `LINE_STEP` where the filter has settled.

    Raises
    ------
    InputError
        A tacho without pulses or that cannot be repaired, a record too short or sampled too slowly.

    Notes
    -----
    Vold-Kalman filter of two poles. With one pulse per revolution it does not matter for the phase
    of a whole order which pulse is the first; with several it would.

    Valid for slow runs: within the filter's third of a second the speed must change by less than a
    resonance is wide, and lines that are passed within it share their noise. 1 Hz/s is slow.
    """
    rate = records[0].rate
    shaft = shaft_angle(repair_pulses(pulse_times(tacho, rate), 1))
    rpm = 60.0 * _lines(shaft)
    found = [
        vold_kalman_spectra(record, shaft, (1.0, *OTHER_ORDERS, BESIDE), rpm, bandwidth=BANDWIDTH)
        for record in records
    ]
    return TrackedSweep(
        tuple(first.spectrum for first, *_ in found),
        tuple(
            np.sqrt(np.mean(np.abs(beside.spectrum.values) ** 2, axis=0) / 2)
            for *_, beside in found
        ),
    )


def _lines(shaft: ShaftAngle) -> RealArray:
    """Within what the filter has settled in, and that the run passes."""
    ends = np.array([shaft.begin + 1 / BANDWIDTH, shaft.end - 1 / BANDWIDTH])
    if not ends[0] < ends[1]:
        raise InputError(
            f"its {shaft.end - shaft.begin:.2f} s are too short for a filter of {BANDWIDTH:g} Hz: "
            "measure for longer"
        )
    low, high = np.sort(shaft.rpm(ends)) / 60.0
    first, last = np.ceil(low / LINE_STEP - 1e-9), np.floor(high / LINE_STEP + 1e-9)
    if last <= first:
        raise InputError(
            f"it runs from {60 * low:.0f} to {60 * high:.0f} 1/min, which holds fewer than two "
            f"lines of {LINE_STEP:g} Hz: run up further"
        )
    return np.asarray(LINE_STEP * np.arange(first, last + 1))
