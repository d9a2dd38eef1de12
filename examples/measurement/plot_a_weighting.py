"""
A-weighting against the standard
================================

The closed form of IEC 61672-1 beside the table that the standard prints. The table is of the
exact mid-band frequencies, 1000 · 10^(n/10) Hz, not of their nominal names.

Data to download:
:download:`iec_61672_1_2013.csv <../../../tests/data/iec61672-cirrus/iec_61672_1_2013.csv>`.
"""

from pathlib import Path

import pandas as pd

import deboom
from deboom.physics.sound_level import a_weighting

# the data in a clone, or downloaded beside this file
DATA = next(p for p in (Path("../../tests/data/iec61672-cirrus"), Path()) if p.exists())

# %%
# The table of the standard up to 500 Hz, at exact and at nominal frequencies [dB].

table = pd.read_csv(DATA / "iec_61672_1_2013.csv").query("nominal <= 500")
printed, nominal = table["A"].to_numpy(), table["nominal"].to_numpy()
exact = 1000 * 10 ** (table["n"].to_numpy() / 10)

# %%
# What is left at the exact frequencies is the rounding of the printed table, ± 0.05 dB.

panels = [
    deboom.plot.CurvePanel(
        "A-weighting",
        exact,
        {"closed form": a_weighting(exact)},
        points={"table of the standard": (exact, printed)},
        y_label="A(f) [dB]",
    ),
    deboom.plot.CurvePanel(
        "Closed form minus table",
        exact,
        {"at exact frequencies": a_weighting(exact) - printed},
        points={"at nominal frequencies": (exact, a_weighting(nominal) - printed)},
        y_label="difference [dB]",
    ),
]
deboom.plot.curve_panels(panels, columns=2, log_frequency=True)
