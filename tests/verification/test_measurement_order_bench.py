"""Order spectra of the bench's time record against the steady states that it was made from."""

import numpy as np
import pytest

from deboom.bench.campaign_plan import CampaignErrors, TimeRunPlan
from deboom.bench.campaign_sensors import draw_campaign_sensors
from deboom.bench.mount_sets import mount_set, with_mount_set
from deboom.bench.parameters import load_bench
from deboom.bench.time_run import record_over_time
from deboom.measurement.order_spectra import computed_order_spectrum, vold_kalman_spectra
from deboom.measurement.shaft_angle import shaft_angle
from deboom.measurement.tacho import pulse_times
from deboom.measurement.tacho_repair import repair_pulses
from deboom.measurement.time_record import TimeRecord

ORDERS = (0.5, 1.5, 3.0, 6.0)
RPM = np.arange(1560.0, 2041.0, 10.0)
PLAN = TimeRunPlan()


@pytest.fixture(scope="module")
def signals():
    bench = load_bench()
    errors = CampaignErrors()
    sensors = draw_campaign_sensors(bench, errors, np.random.SeedSequence(1))
    on_bench = with_mount_set(bench, mount_set(PLAN.mount_set, bench))
    return record_over_time(on_bench, sensors, PLAN, errors, np.random.default_rng(1))


@pytest.fixture(scope="module")
def shaft(signals):
    times = pulse_times(signals.tacho, PLAN.sample_rate)
    return shaft_angle(repair_pulses(times, PLAN.pulses_per_revolution))


def test_speed_is_the_true_one(signals, shaft):
    inside = (signals.time >= shaft.begin) & (signals.time <= shaft.end)
    np.testing.assert_allclose(shaft.rpm(signals.time[inside]), signals.speed[inside], rtol=1e-4)


@pytest.mark.parametrize("quantity", ["acceleration", "cell_force"])
def test_amplitude_within_one_percent_and_phase_within_one_degree(signals, shaft, quantity):
    """Every channel above a tenth of the largest; order 1.5 sweeps 2.5 Hz/s beside 0.5, 3 and 6."""
    values = getattr(signals, quantity)
    names = tuple(f"C{i}" for i in range(values.shape[1]))
    record = TimeRecord(values, PLAN.sample_rate, names, "N")
    true_rpm = signals.steady.frequency * 60 / 1.5
    truth = getattr(signals, f"steady_{quantity}")[np.searchsorted(true_rpm, RPM - 0.1)]
    loud = np.abs(truth) > 0.1 * np.abs(truth).max()
    assert np.count_nonzero(loud) > 500
    for spectrum in (
        computed_order_spectrum(record, shaft, 1.5, RPM, revolutions=12),
        vold_kalman_spectra(record, shaft, ORDERS, RPM, bandwidth=3.0)[1],
    ):
        ratio = spectrum.spectrum.values[loud] / truth[loud]
        assert np.abs(np.abs(ratio) - 1).max() < 0.01
        assert np.rad2deg(np.abs(np.angle(ratio))).max() < 1.0
        assert np.median(np.abs(np.abs(ratio) - 1)) < 0.001
        assert spectrum.smear.max() < 1.8
