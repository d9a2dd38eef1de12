"""A response that is not deboom's: a supplier's Excel of levels and their slopes, made robust.

Any function ``designs (n, variables) -> responses (n, responses)`` will do: a call of an FE solver,
a neural network, a table. `deboom.ResponseFunction` says what its columns are.
"""

from pathlib import Path

import pandas as pd

import deboom

SHEET = pd.read_excel(Path(__file__).with_name("supplier_levels.xlsx"), index_col="vehicle")
TODAY, SLOPES = SHEET.iloc[:, 0].to_numpy(), SHEET.iloc[:, 1:].to_numpy()
FACTORS = tuple(name.removesuffix(" [dB]") for name in SHEET.columns[1:])


def levels(designs):
    """Return levels (n, vehicles) [dB(A)] of stiffness factors (n, variables)."""
    return TODAY + (designs - 1.0) @ SLOPES.T


model = deboom.ResponseFunction(levels, FACTORS, tuple(SHEET.index), "dB(A)")
robust = deboom.Robust(model, model.design_space(bounds=0.2, tolerance=0.15), draws=64)

if __name__ == "__main__":
    front = deboom.search(robust, population=20, generations=30)
    print(front.designs().join(front.table.iloc[:, 2:4]).round(3).to_string(index=False))
