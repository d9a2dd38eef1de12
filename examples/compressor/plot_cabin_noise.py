"""
What of a compressor is heard in an electric car
================================================

Loads through mounts and hoses times the noise transfer functions of the car give the sound at
the ear (thesis, section 4.5 and figure 65), beside what the microphone measured.
"""

import tempfile
from pathlib import Path

import numpy as np

import deboom

folder = Path(tempfile.mkdtemp()) / "car"
deboom.bench.write_electric_car(folder, seed=1)
car = deboom.read_electric_car(folder)
running = deboom.running_in_car(car, deboom.identify(car.operation.hammer))
sweeps = deboom.cabin_noise(running)
sweeps[0].table

# %%
# The first sweep, with the hoses of the vehicle: they carry the sound above 60 Hz.

noise = sweeps[0]
panel = deboom.plot.CurvePanel(
    "A compressor in an electric car, at the ear",
    noise.frequency,
    {
        "measured": noise.level(noise.measured),
        "mounts and hoses": noise.level(noise.total),
        "mounts alone": noise.level(noise.by_mounts),
    },
)
deboom.plot.curve_panels([panel], y_label="level [dB(A)]", dashed=["measured"])

# %%
# With all paths the synthesis follows the measurement; without the hoses it misses by far more.

inside = noise.frequency >= 30
error, without = (
    np.median(np.abs(noise.table[name] - noise.table["measured [dB(A)]"])[inside])
    for name in ("synthesised [dB(A)]", "mounts alone [dB(A)]")
)
print(f"median error {error:.2f} dB, without hoses {without:.1f} dB")
