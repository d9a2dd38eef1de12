"""
Tutorial 2: compressor mounts, from hammer blows to the supplier's sheet
========================================================================

A refrigerant compressor under the hammer, running, and in an electric car: its mounts and mass, its
unbalance, what the driver hears of it, and the sheet for mounts that make it quieter. ``shell``
types a command into a terminal in an empty folder, and shows what the terminal prints.
"""

import subprocess
import tempfile
from functools import partial
from pathlib import Path

import pandas as pd

import deboom

folder = Path(tempfile.mkdtemp())
shell = partial(subprocess.check_output, shell=True, text=True, cwd=folder)

# %%
# **1. The folder.** `car.toml` names the files of one electric car and its compressor; the
# virtual bench writes one with the errors of real sensors, so that the truth is known. `deboom
# new car my_car` writes one to fill in.

deboom.bench.write_electric_car(folder / "car", seed=1)
print(*sorted(path.name for path in (folder / "car").iterdir()), sep="\n")
car = deboom.read_electric_car(folder / "car")

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
# **4. In the car**: what each mount and each hose brings to the driver's ear, over the speed.

noise = deboom.cabin_noise(running)[0]
noise.table.head()

# %%
# **5. Quieter mounts**, over the scatter of parts: the study searches axial and radial stiffness,
# with a limit to how far the compressor may travel. Without `--cars` it takes five virtual cars,
# with `--cars my_car` yours. A real search takes the defaults.

options = "--generations 4 --population 12 --samples 8 --checks 32 --n 16"
print(shell(f"deboom run compressor_front {options}"))
picks = deboom.read_run(folder / "results/compressor_front/latest").table("picks")
picks.round(2)

# %%
# **6. The sheet**: what goes into a quotation, softer than today radially.

print(shell("deboom report compressor_front/latest --supplier --out sheets"))
(workbook,) = (folder / "sheets").glob("*.xlsx")
sheet = pd.read_excel(workbook, sheet_name="data block", index_col="direction")
stiffness = ["accepted from [N/mm]", "new |K| [N/mm]", "accepted to [N/mm]", "today |K| [N/mm]"]
sheet[stiffness].round(1)

# %%
# Each stiffness today, and as the sheet asks for it.

lower, new, upper, today = (sheet[name] for name in stiffness)
panel = deboom.plot.IntervalPanel(
    "dynamic stiffness [N/mm]",
    {"today": (today, today, today), "new, accepted": (new, lower, upper)},
    title="Compressor mounts of the sheet",
)
deboom.plot.interval_panels(list(sheet.index), [panel])
