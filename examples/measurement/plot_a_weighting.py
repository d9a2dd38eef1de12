"""
A-weighting against the standard
================================

The closed form of IEC 61672-1 beside the table that the standard prints. The table holds at the
exact mid-band frequencies, 1000 · 10^(n/10) Hz, not at their nominal names.

Data to download:
:download:`iec_61672_1_2013.csv <../../../tests/data/iec61672-cirrus/iec_61672_1_2013.csv>`.
"""

from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
import pandas as pd

from deboom.physics.sound_level import a_weighting

DATA = Path("../../tests/data/iec61672-cirrus")  # or the folder of the files that you downloaded

# %%
# The table of the standard, and the weighting at exact and at nominal frequencies [dB].

table = pd.read_csv(DATA / "iec_61672_1_2013.csv")
exact = 1000 * 10 ** (table["n"].to_numpy() / 10)
at_exact = a_weighting(exact) - table["A"]
at_nominal = a_weighting(table["nominal"]) - table["A"]

# %%
# What is left at the exact frequencies is the rounding of the printed table.

figure, (curve, difference) = plt.subplots(2, 1, sharex=True, layout="constrained")
curve.semilogx(exact, a_weighting(exact), label="closed form")
curve.semilogx(exact, table["A"], "o", markersize=4, label="table")
curve.set(ylabel="A(f) [dB]")
curve.legend()
difference.semilogx(exact, at_exact, "o", label="at exact frequencies")
difference.semilogx(exact, at_nominal, "x", label="at nominal frequencies")
difference.set(xlabel="frequency [Hz]", ylabel="closed form − table [dB]")
difference.legend()

assert np.abs(at_exact).max() < 0.05
assert np.abs(at_nominal).max() > 0.2
