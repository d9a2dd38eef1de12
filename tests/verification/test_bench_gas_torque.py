"""The order torque of the bench against a combustion cycle that is integrated here.

A 1.5 l three-cylinder engine with turbocharger: bore 82 mm, stroke 94.6 mm, rod 148.2 mm,
compression ratio 11; single zone, Wiebe heat release, polytropic wall losses.
"""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from deboom.bench.excitation import THREE_CYLINDER_TORQUE

BORE, STROKE, ROD, COMPRESSION = 0.082, 0.0946, 0.1482, 11.0
PISTON = np.pi * BORE**2 / 4
CLEARANCE = PISTON * STROKE / (COMPRESSION - 1)
CRANK = STROKE / 2
AMBIENT, EXHAUST = 1.0e5, 1.1e5
CLOSES, OPENS, DURATION = -140.0, 140.0, 45.0
FRICTION = 14.0


def travel(angle):
    return CRANK * (1 - np.cos(angle)) + ROD - np.sqrt(ROD**2 - (CRANK * np.sin(angle)) ** 2)


def lever(angle):
    beside = np.sqrt(ROD**2 - (CRANK * np.sin(angle)) ** 2)
    return CRANK * np.sin(angle) * (1 + CRANK * np.cos(angle) / beside)


def cylinder_pressure(intake, half_burnt, degrees):
    """Pressure over two revolutions, 0 is the firing dead centre."""
    charge = intake * (CLEARANCE + PISTON * travel(np.deg2rad(CLOSES))) / (287 * 330)
    heat = charge / 14.5 * 42.5e6 * 0.80
    start = half_burnt - (np.log(2) / 5) ** (1 / 3) * DURATION

    def rate(angle, pressure):
        burning = angle > start
        x = max(angle - start, 0.0) / DURATION
        released = heat * 15 * x**2 / DURATION * np.exp(-5 * x**3)
        exponent = 1.27 if burning else 1.33
        volume = CLEARANCE + PISTON * travel(np.deg2rad(angle))
        growth = PISTON * lever(np.deg2rad(angle)) * np.pi / 180
        return ((exponent - 1) * released - exponent * pressure * growth) / volume

    closed = solve_ivp(
        rate, (CLOSES, OPENS), [intake], max_step=1.0, rtol=1e-8, atol=1.0, dense_output=True
    )
    pressure = np.full(degrees.size, EXHAUST + 0.05 * intake)
    pressure[degrees < CLOSES] = intake
    inside = (degrees >= CLOSES) & (degrees <= OPENS)
    pressure[inside] = closed.sol(degrees[inside])[0]
    blowdown = (degrees > OPENS) & (degrees <= 180)
    pressure[blowdown] = np.linspace(closed.y[0, -1], EXHAUST, blowdown.sum())
    # two revolutions start at the gas exchange: before -180 deg the intake valve is open
    pressure[degrees < -180] = intake
    return pressure


def engine_torque(intake, half_burnt):
    """Mean brake torque and complex order 1.5 of three cylinders in phase at that order."""
    degrees = np.linspace(-360, 360, 2880, endpoint=False)
    angle = np.deg2rad(degrees)
    torque = (cylinder_pressure(intake, half_burnt, degrees) - AMBIENT) * PISTON * lever(angle)
    mean = 3 * torque.mean() - FRICTION
    return mean, 3 * 2 * np.mean(torque * np.exp(-1.5j * angle))


# combustion is early at high speed, and late at low speed where knock limits it
@pytest.mark.parametrize(("half_burnt", "rpm"), [(8.0, 3200.0), (18.0, 800.0)])
@pytest.mark.parametrize("intake", [0.5e5, 1.1e5, 1.7e5])
def test_order_torque_over_load(intake, half_burnt, rpm):
    mean, order = engine_torque(intake, half_burnt)
    modelled = THREE_CYLINDER_TORQUE.torque(np.array([mean]), np.array([rpm]))[0]
    assert abs(modelled) == pytest.approx(abs(order), rel=0.05)
    assert np.rad2deg(np.angle(modelled / order)) == pytest.approx(0, abs=3)


def test_three_cylinders_have_no_inertia_torque_at_order_1_5():
    degrees = np.arange(720.0)
    angle = np.deg2rad(degrees)
    acceleration = np.gradient(np.gradient(travel(angle), angle), angle)
    acceleration[[0, 1, -2, -1]] = acceleration[[360, 361, 358, 359]]
    single = -acceleration * lever(angle)
    engine = sum(np.roll(single, 240 * cylinder) for cylinder in range(3))
    orders = np.abs(np.fft.rfft(engine)) / degrees.size  # half orders: two revolutions
    assert orders[3] < 1e-6 * orders[6]
    assert orders[6] > 0
