"""A response that is not deboom's: a supplier's Excel of levels and their slopes, made robust.

Any function ``designs (n, variables) -> responses (n, responses)`` will do: a call of an FE solver,
a neural network, a table. Three attributes tell deboom what its columns are.
"""

from pathlib import Path

import pandas as pd

from deboom.explore.robust import RobustResponse
from deboom.explore.scatter import sobol_sample
from deboom.explore.search import nsga2
from deboom.explore.space import stiffness_factor_space

SHEET = pd.read_excel(Path(__file__).with_name("supplier_levels.xlsx"), index_col="vehicle")


class Supplier:
    """Level of each vehicle: today's, and dB per 1 of each stiffness factor beyond it."""

    variable_names = tuple(name.removesuffix(" [dB]") for name in SHEET.columns[1:])
    response_names = tuple(SHEET.index)
    response_unit = "dB(A)"

    def __call__(self, designs):
        """Return levels (n, vehicles) of stiffness factors (n, variables)."""
        return SHEET.iloc[:, 0].to_numpy() + (designs - 1.0) @ SHEET.iloc[:, 1:].to_numpy().T


space = stiffness_factor_space(Supplier.variable_names, half_width=0.2, tolerance=0.15)
robust = RobustResponse(Supplier(), space, sobol_sample(space.n_variables, 64, seed=1))

if __name__ == "__main__":
    front = nsga2(robust, population=20, generations=30, seed=1).front
    designs = pd.DataFrame(front.designs, columns=space.names)
    print(designs.assign(mean=front.mean_sum, sigma=front.sigma_sum).round(3))
