"""
A delivery against its acceptance box
=====================================

Measured parts pass, fail or stay undecided: a part is refused only if it is outside with all of
its measuring uncertainty (ISO 14253-1), and batches are judged by their capability.

Data to download: :download:`acceptance_box.json
<../../../tests/data/deboom-0.3.0/results/solution_box/2026-11-28_213837_seed1/acceptance_box.json>`.
"""

from pathlib import Path

import numpy as np

import deboom
from deboom.files.acceptance import DeliveredPart

# %%
# The box that a run of the study ``solution_box`` wrote, in the data of a clone or downloaded
# beside this file.

RUN = Path("../../tests/data/deboom-0.3.0/results/solution_box/2026-11-28_213837_seed1")
box = deboom.read_solution_box((RUN if RUN.exists() else Path()) / "acceptance_box.json")
strut = next(variable for variable in box.variables if variable.name == "TSM x")
lower, upper = (1e-3 * strut.reference_stiffness_n_per_m * f for f in (strut.lower, strut.upper))
print(f"accepted from {lower:.0f} to {upper:.0f} N/mm")

# %%
# Two batches of 20 parts, and one of four with an outlier [N/m]. `deboom.read_delivered_parts`
# reads them from a table.

rng = np.random.default_rng(1)
batches = {
    "K1": rng.normal(440e3, 6e3, 20),
    "K2": rng.normal(514e3, 4e3, 20),
    "K3": np.array([440e3, 445e3, 438e3, 540e3]),
}
parts = [
    DeliveredPart(f"{name}-{number:02}", name, "TSM", {"x": value, "z": rng.normal(160e3, 2e3)})
    for name, values in batches.items()
    for number, value in enumerate(values, start=1)
]
delivery = deboom.judged_delivery(box, parts, None, uncertainty=0.02, seed=1)
print({batch.name: batch.verdict.value for batch in delivery.batches})

# %%
# Accepted is the band; within the darker one a part passes for sure, given the 2 % by which its
# measurement may be wrong.

figure = deboom.plot.strips(
    {"|K| of TSM x [N/mm]": {name: values / 1e3 for name, values in batches.items()}}
)
(axes,) = figure.axes
axes.axvspan(lower, upper, alpha=0.15)
axes.axvspan(lower * 1.02, upper * 0.98, alpha=0.15)
