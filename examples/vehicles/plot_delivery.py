"""
A delivery against its acceptance box
=====================================

Measured parts pass, fail or stay undecided: a part is refused only if it is outside with all of
its measuring uncertainty (ISO 14253-1), and batches are judged by their capability.
"""

import matplotlib.pyplot as plt
import numpy as np

import deboom
from deboom.files.acceptance import AcceptanceBox, BoxResponse, BoxVariable, DeliveredPart

# %%
# A box as a study writes it (`deboom.read_solution_box`): here one direction of the strut.

box = AcceptanceBox(
    title="torque strut", platform="u06", platform_sha256="none", group="U06", motion="coupled",
    mounts="library", load_cases=(("g5_wot220", 1.0),), band_hz=(20.0, 60.0),
    quantity="mean level of the lines", unit="dB(A)", together=False,
    variables=(
        BoxVariable(
            name="TSM x", lower=0.68, upper=0.83, searched=(0.68, 1.38), nominal=0.8,
            reference_stiffness_n_per_m=532e3, condition="-1242 N, 29 Hz", weight=1.0,
            required=True,
        ),
    ),
    responses=(BoxResponse(name="U06-1", limit=62.0, share=0.96),),
    share_stated=0.95, share_verified=0.96, share_bound=0.95, share_measured_again=None,
    confidence=0.95, n_parts=131072,
    law="uniform in the box", seed=1,
)  # fmt: skip

# %%
# Two batches of 20 parts, and one of four with an outlier [N/m].

rng = np.random.default_rng(1)
batches = {
    "K1": rng.normal(400e3, 6e3, 20),
    "K2": rng.normal(430e3, 6e3, 20),
    "K3": np.array([400e3, 405e3, 398e3, 470e3]),
}
parts = [
    DeliveredPart(f"{name}-{number:02}", name, "TSM", {"x": value})
    for name, values in batches.items()
    for number, value in enumerate(values, start=1)
]
delivery = deboom.judged_delivery(box, parts, None, uncertainty=0.02, seed=1)
delivery.table.head()

# %%
# The interval, with the 2 % that a measurement may be off at both ends.

lower, upper = (1e-3 * 532e3 * end for end in (0.68, 0.83))
figure, axes = plt.subplots(layout="constrained")
for place, values in enumerate(batches.values()):
    axes.plot(np.full(len(values), place), values / 1e3, "o", markersize=4)
axes.axhspan(lower, upper, alpha=0.2)
axes.axhspan(lower * 1.02, upper * 0.98, alpha=0.2)
axes.set(ylabel="dynamic stiffness of TSM x [N/mm]", xticks=range(3), xticklabels=batches)

verdicts = {batch.name: batch.verdict.value for batch in delivery.batches}
print(verdicts)
assert verdicts == {"K1": "pass", "K2": "undecided", "K3": "fail"}
