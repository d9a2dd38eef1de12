"""
Tutorial 1: engine mounts, from files to the supplier's sheet
=============================================================

A platform of measurement files becomes a robust front, acceptance intervals and the sheet that a
mount supplier quotes, and a delivery is judged by it. ``shell`` types a command into a terminal in
an empty folder, and shows what the terminal prints.
"""

import subprocess
import tempfile
from functools import partial
from pathlib import Path

import numpy as np
import pandas as pd

import deboom

folder = Path(tempfile.mkdtemp())
shell = partial(subprocess.check_output, shell=True, text=True, cwd=folder)

# %%
# **1. The folder.** `platform.toml` names the files: noise transfer functions of every vehicle,
# spectra at the mounts in operation, and the mounts. `deboom new platform my_platform` writes one
# to fill in, `deboom example` invents one, and `deboom check` compares what it states with its
# data. What follows takes ``u06``, which is shipped.

print(shell("deboom example example"))
print(shell("deboom check example/platform"))

# %%
# **2. What is heard today**, and through which mount? A model turns stiffness factors, 1 for
# today's parts, into the level of each vehicle.

model = deboom.read_platform("u06").model(vehicles="U06", band=(24, 40), motion="coupled")
paths = model.paths(np.ones(len(model.variable_names)), "U06-1")
paths.table.head(4)

# %%
# **3. The robust front**: designs that are quiet over the scatter of parts as well. A study
# searches it, verifies it with draws that the search has not seen, and writes a page;
# `report.html` in its folder is the one to open. By default the study takes more:
# `--generations 30 --population 100`.

options = "--band 24 40 --generations 6 --population 16 --samples 16 --no-polish"
print(shell(f"deboom run front {options}"))

# %%
# What the quietest design does to each vehicle, today and new, with three σ of the scatter.

front = deboom.read_run(folder / "results/front/latest")
vehicles = front.table("vehicles").set_index("vehicle")
groups = {}
for name, when in (("today", "before"), ("new", "after")):
    level = vehicles[f"level {when} [dB(A)]"]
    reach = 3 * vehicles[f"sigma {when} [dB]"]
    groups[name] = (level, level - reach, level + reach)
panel = deboom.plot.IntervalPanel("mean level of the lines [dB(A)]", groups, title="Five cars")
deboom.plot.interval_panels(list(vehicles.index), [panel])

# %%
# **4. Acceptance intervals**: a supplier needs intervals, not a point. In this box 95 % of all
# parts keep most of what the design brings to every vehicle.

print(shell("deboom run solution_box --front front/latest --band 24 40"))

# %%
# **5. The sheet**: a page and a workbook for each mount. The workbook's table is what goes into a
# quotation: dynamic stiffness, where from and to, at which preload, amplitude and frequency.

command = "deboom report front/latest --supplier --mount TSM --box solution_box/latest --out sheets"
print(shell(command))
workbook = folder / "sheets" / "supplier_sheet_TSM.xlsx"
sheet = pd.read_excel(workbook, sheet_name="data block", index_col="direction")
sheet[["class", "accepted from [N/mm]", "new |K| [N/mm]", "accepted to [N/mm]"]].round(1)

# %%
# **6. A delivery** comes back: invented parts, which were made for another box. They pass, fail or
# stay undecided.

parts = "example/delivered_parts.csv"
print(shell(f"deboom accept solution_box/latest {parts} --platform u06 --uncertainty 0.02"))
