"""
Tutorial: compressor mounts, from hammer blows to the supplier's sheet
======================================================================

A refrigerant compressor under the hammer, running, and in an electric car: its mounts and mass, its
unbalance, what the driver hears of it, and the sheet for mounts that make it quieter.
"""

import shlex
import subprocess
import sys
import tempfile
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
import pandas as pd

import deboom

results = Path(tempfile.mkdtemp())


def terminal(command):
    """Type a command of deboom, show what it prints, and return its last line: a file or folder."""
    arguments = [sys.executable, "-m", "deboom", *shlex.split(command)]
    done = subprocess.run(arguments, capture_output=True, text=True, check=True)
    typed = f"$ deboom {command}\n{done.stdout.rstrip()}"
    print(typed.replace(str(results), "results"))
    return done.stdout.rstrip().splitlines()[-1]


# %%
# **1. The folder.** `car.toml` names the files of one electric car and its compressor; the
# virtual bench writes one with the errors of real sensors, so that the truth is known. `deboom
# new car my_car` writes one to fill in.

folder = results / "car"
deboom.bench.write_electric_car(folder, seed=1)
print(*sorted(path.name for path in folder.iterdir()), sep="\n")
car = deboom.read_electric_car(folder)

# %%
# **2. The hammer test**: mass, centre of gravity, inertia and the mounts, with intervals.

identified = deboom.identify(car.operation.hammer)
identified.table.head(8)

# %%
# **3. Running**: the unbalance that nobody can weigh, beside gas forces. The bench put 20 g mm
# there.

running = deboom.running_in_car(car, identified)
static = 1e6 * abs(running.source.chosen.sources.static.value)
print(f"static unbalance {static:.1f} g mm")

# %%
# **4. In the car**: what the driver hears of it, mounts and hoses, beside the microphone.

noise = deboom.cabin_noise(running)[0]
figure, axes = plt.subplots(layout="constrained")
axes.plot(noise.frequency, noise.level(noise.measured), "k", label="measured")
axes.plot(noise.frequency, noise.level(noise.total), label="mounts and hoses")
axes.plot(noise.frequency, noise.level(noise.by_mounts), "--", label="mounts alone")
axes.set(xlabel="frequency of the rotation [Hz]", ylabel="level at the ear [dB(A)]")
axes.legend()

# %%
# **5. Quieter mounts**, over the scatter of parts: the study searches axial and radial stiffness,
# with a limit to how far the compressor may travel. Without `--cars` it takes five virtual cars,
# with `--cars my_car` yours. A real search takes the defaults.

front = terminal(
    f"run compressor_front --generations 4 --population 12 --samples 8 --checks 32 --n 16 "
    f"--out {results}"
)
picks = pd.read_csv(Path(front) / "picks.csv", index_col="design")
picks.round(2)

# %%
# **6. The sheet**: what goes into a quotation.

workbook = terminal(f"report {front} --supplier")
sheet = pd.read_excel(workbook, sheet_name="data block", index_col="direction")
sheet[
    [
        "accepted from [N/mm]",
        "new |K| [N/mm]",
        "accepted to [N/mm]",
        "today |K| [N/mm]",
        "static rate [N/mm]",
    ]
].round(1)

# %%
# Softer radially, and quieter: by how much, and what it costs in travel.

change = picks.loc["best-mean", "change [dB]"]
travel = picks["travel under 1 g [mm]"]
print(f"{change:.1f} dB on average, travel {travel.iloc[0]:.2f} mm to {travel['best-mean']:.2f} mm")
assert abs(static / 20 - 1) < 0.05
assert change < -1.5
assert np.all(sheet["new |K| [N/mm]"] < sheet["today |K| [N/mm]"])
