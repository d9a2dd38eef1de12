"""
Tutorial: engine mounts, from files to the supplier's sheet
===========================================================

A platform of measurement files becomes a robust front, acceptance intervals and the sheet that a
mount supplier quotes, and a delivery is judged by it. The terminal's commands are used as they are.
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
from deboom.files.acceptance import DeliveredPart
from deboom.files.platform import DEMONSTRATION

results = Path(tempfile.mkdtemp())


def terminal(command):
    """Type a command of deboom, show what it prints, and return its last line: a file or folder."""
    arguments = [sys.executable, "-m", "deboom", *shlex.split(command)]
    done = subprocess.run(arguments, capture_output=True, text=True, check=True)
    typed = f"$ deboom {command}\n{done.stdout.rstrip()}"
    print(typed.replace(str(results), "results").replace(str(DEMONSTRATION), "u06"))
    return done.stdout.rstrip().splitlines()[-1]


# %%
# **1. The folder.** `platform.toml` names the files: noise transfer functions of every vehicle,
# spectra at the mounts in operation, and the mounts. `deboom new platform my_platform` writes one
# to fill in, and `deboom check` holds what it states against its data.

print(*sorted(path.name for path in DEMONSTRATION.iterdir()), sep="\n")
terminal(f"check {DEMONSTRATION}")

# %%
# **2. What is heard today**, and through which mount? A model turns stiffness factors, 1 for
# today's parts, into the level of each vehicle.

model = deboom.read_platform("u06").model(vehicles="U06", band=(24, 40), motion="coupled")
today = np.ones((1, len(model.variable_names)))
levels = model(today)[0] / model.n_lines
print(dict(zip(model.response_names, levels.round(1).tolist(), strict=True)), "dB(A)")

paths = model.paths(today[0], "U06-1")
paths.table.head(4)

# %%
# **3. The robust front**: designs that are quiet over the scatter of parts as well. A study
# searches it, verifies it with draws that the search has not seen, and writes a page;
# `report.html` in its folder is the one to open. The default budget of the study is larger:
# `--generations 30 --population 100`.

front = terminal(
    f"run front --band 24 40 --generations 6 --population 16 --samples 16 --no-polish "
    f"--out {results}"
)
picks = pd.read_csv(Path(front) / "picks.csv", index_col="design")
picks.iloc[:, :4].round(2)

# %%
# What the quietest design does to each vehicle.

vehicles = pd.read_csv(Path(front) / "vehicles.csv", index_col="vehicle")
figure, axes = plt.subplots(layout="constrained")
places = np.arange(len(vehicles))
for shift, when in ((-0.2, "before"), (0.2, "after")):
    axes.bar(
        places + shift,
        vehicles[f"level {when} [dB(A)]"],
        0.4,
        yerr=3 * vehicles[f"sigma {when} [dB]"],
        label=f"{when}, with 3 σ of the scatter",
    )
axes.set(xticks=places, xticklabels=vehicles.index, ylabel="mean level of the lines [dB(A)]")
axes.set_ylim(bottom=45)
axes.legend()

# %%
# **4. Acceptance intervals**: a supplier needs intervals, not a point. In this box 95 % of all
# parts keep every vehicle as quiet as today, at least.

box = terminal(f"run solution_box --front {front} --band 24 40 --out {results}")
intervals = deboom.read_solution_box(box)
print(f"at least {100 * intervals.share_bound:.1f} % of the parts, of {intervals.n_parts} tried")

# %%
# **5. The sheet**: a page and a workbook for each mount. The workbook's table is what goes into a
# quotation: dynamic stiffness, where from and to, at which preload, amplitude and frequency.

workbook = terminal(f"report {front} --supplier --mount TSM --box {box}")
sheet = pd.read_excel(workbook, sheet_name="data block", index_col="direction")
sheet[
    [
        "class",
        "accepted from [N/mm]",
        "new |K| [N/mm]",
        "accepted to [N/mm]",
        "preload [N]",
        "frequency [Hz]",
    ]
].round(0)

# %%
# **6. A delivery**: twenty measured struts come back. `deboom accept` judges the filled-in
# workbook; a notebook judges numbers.

rng = np.random.default_rng(1)
wanted = 1e3 * sheet["new |K| [N/mm]"]
parts = [
    DeliveredPart(
        f"S-{number}",
        "first",
        "TSM",
        {axis: rng.normal(1.0, 0.02) * wanted[f"TSM {axis}"] for axis in "xz"},
    )
    for number in range(1, 21)
]
delivery = deboom.judged_delivery(intervals, parts, None, uncertainty=0.02, seed=1)
print({batch.name: batch.verdict.value for batch in delivery.batches})

change = picks.loc["best-mean", "change [dB]"]
print(f"best-mean {change:.1f} dB per line against today")
assert change < -1.5
assert sheet.loc["TSM x", "class"] == "must"
