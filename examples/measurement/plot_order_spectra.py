"""
Order spectra of a run-up, beside another code
==============================================

A Vold-Kalman filter takes the orders 0.5, 1.5 and 3 out of a run-up through a resonance. The
envelopes that ROTA, another code, found in the same record are its judge.

Data to download:
:download:`envelopes.csv <../../../tests/data/rota-order/envelopes.csv>`.
"""

from pathlib import Path

import numpy as np

import deboom
from deboom.physics.order_tracking import vold_kalman

# %%
# The run: 900 to 2700 1/min in 8 s, order 1.5 through a mode at 42 Hz, a tone at 50 Hz.

rate = 2048.0
time = np.arange(8 * 2048) / rate
rpm = 900 + 225 * time
angle = 2 * np.pi * (900 * time + 112.5 * time**2) / 60
ratio = 1.5 * rpm / 60 / 42
main = 2j / (1 - ratio**2 + 0.12j * ratio)
record = (
    np.real(main * np.exp(1.5j * angle))
    + 0.5 * np.cos(0.5 * angle + 1)
    + np.cos(3 * angle - 0.4)
    + 0.3 * np.cos(2 * np.pi * 50 * time)
)

# %%
# All orders are solved together; the width of a filter is that between its half-power points.

orders = np.array([0.5, 1.5, 3.0])
phase = orders * angle[:, np.newaxis]
envelopes = vold_kalman(record[:, np.newaxis], phase, rate, np.full(3, 6.0))[:, :, 0]

# %%
# Every 400th sample of ROTA, away from the ends of the record, in the data of a clone or downloaded
# beside this file.

data = next(p for p in (Path("../../tests/data/rota-order"), Path()) if p.exists())
columns = np.genfromtxt(data / "envelopes.csv", delimiter=",", names=True)
rota = np.array([columns[f"re_{q:g}".replace(".", "")] for q in orders])
rota = rota + 1j * np.array([columns[f"im_{q:g}".replace(".", "")] for q in orders])
inside = (columns["time_s"] > 1.0) & (columns["time_s"] < 7.0)

curves = {f"order {q:g}": np.abs(mine) for q, mine in zip(orders, envelopes.T, strict=True)}
points = {
    f"order {q:g}": (rpm[::400][inside], np.abs(other[inside]))
    for q, other in zip(orders, rota, strict=True)
}
panel = deboom.plot.CurvePanel("Orders of a run-up; dots: ROTA", rpm, curves, points=points)
deboom.plot.curve_panels([panel], x_label="engine speed [1/min]", y_label="amplitude [m/s²]")
