"""
Within which stiffnesses may parts be delivered?
================================================

A supplier needs intervals, not a point. The largest box of stiffness factors in which 90 % of
parts and vehicles are one decibel below today, verified with parts that the search never saw.
"""

import numpy as np

import deboom
from deboom.explore.largest_box import BoxEffort

model = deboom.read_platform("u06").model(vehicles="U06", band=(24, 40), motion="coupled")
space = model.design_space(bounds=0.40)
today = model(np.ones((1, 12)))[0]

# %%
# Limits are sums over lines like the responses: 1 dB per line.

limit = today - 1.0 * model.n_lines
question = deboom.BoxQuestion(model, limit, 0.90, space.lower, space.upper)
effort = BoxEffort(starts=1, calibration=8192, verification=16384)
largest = deboom.largest_box(question, seed=1, effort=effort)
largest.table

# %%
# Directions that no vehicle depends on keep their whole range; TSM x is bounded from above.

box = largest.box
middle = (box.lower + box.upper) / 2
panel = deboom.plot.IntervalPanel(
    "stiffness over today's [1]",
    {"accepted": (middle, box.lower, box.upper)},
    title="Largest box one decibel below today",
    allowed=(space.lower, space.upper),
)
deboom.plot.interval_panels(box.names, [panel])

# %%
# The bound of the share has a confidence of 95 %.

share = largest.verified
print(f"{100 * share.share:.1f} % of {share.n_parts} parts, at least {100 * share.bound:.1f} %")
