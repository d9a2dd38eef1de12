"""
Models that are not deboom's
============================

A supplier's Excel table and a Gaussian process of scikit-learn take the place of the booming
model: whatever turns designs into responses gives a front, an index and a tolerance.
"""

import matplotlib.pyplot as plt
import numpy as np
import pandas as pd
from sklearn.gaussian_process import GaussianProcessRegressor
from sklearn.gaussian_process.kernels import RBF, ConstantKernel
from sklearn.pipeline import make_pipeline
from sklearn.preprocessing import MinMaxScaler

import deboom

# %%
# Levels and slopes of a supplier's sheet: one row per vehicle, one column per factor.
# ``pd.read_excel("levels.xlsx", index_col="vehicle")`` reads such a table from a file.

columns = ("level [dB(A)]", "TSM x [dB]", "GeM x [dB]", "EnM z [dB]")
rows = {"wagon": (62.4, 6.5, 1.5, -2.0), "cabrio": (64.1, 4.0, 5.5, 0.5)}
sheet = pd.DataFrame.from_dict(rows, orient="index", columns=columns)
today, slopes = sheet.iloc[:, 0].to_numpy(), sheet.iloc[:, 1:].to_numpy()
names = tuple(name.removesuffix(" [dB]") for name in sheet.columns[1:])
table = deboom.ResponseFunction(
    lambda designs: today + (designs - 1.0) @ slopes.T, names, tuple(sheet.index), "dB(A)"
)
front = deboom.search(deboom.Robust(table, table.design_space()), population=20, generations=15)
front.table.iloc[:3, 1:4]

# %%
# A regressor that learned 128 designs of the platform's model, and the front that it promises. Its
# inputs are stiffnesses in N/mm. A scaler brings them to 0 to 1, and the kernel has a length for
# each: with the default kernel, of one fixed length, the prediction would be flat.

model = deboom.read_platform("u06").model(vehicles="U06", band=(24, 40), motion="coupled")
space = model.design_space(bounds=0.20)
wide = model.design_space(bounds=0.30)  # parts scatter beyond the bounds of the search
known = deboom.doe(model, wide, n=128, seed=1).doe
today_stiffness = np.linspace(150.0, 1800.0, space.n_variables)  # [N/mm]
kernel = ConstantKernel(1.0, (1e-3, 1e5)) * RBF(np.ones(space.n_variables), (0.05, 1e3))
process = GaussianProcessRegressor(kernel, alpha=1e-8, normalize_y=True, random_state=1)
regressor = make_pipeline(MinMaxScaler(), process)
regressor.fit(known.designs * today_stiffness, known.responses)
learned = deboom.ResponseFunction(
    lambda factors: regressor.predict(factors * today_stiffness),
    model.variable_names,
    model.response_names,
    "dB(A)",
    model.n_lines,
)
robust = deboom.Robust(learned, space, draws=32)
promised = deboom.search(robust, population=20, generations=15, verified_with=64)

# %%
# The front was verified by the regressor, which cannot see its own errors. The model itself judges:
# how far is what the regressor promises?

true = deboom.Robust(model, space, draws=64, seed=2)(promised.values.designs)
scale = promised.per_line
figure, axes = plt.subplots(layout="constrained")
axes.plot(promised.values.mean_sum * scale, promised.values.sigma_sum * scale, "o", label="learned")
axes.plot(true.mean_sum * scale, true.sigma_sum * scale, "x", label="the model")
axes.set(xlabel="mean level per line [dB(A)]", ylabel="its σ [dB]")
axes.legend()

off = np.abs(true.mean_sum - promised.values.mean_sum) * scale
share = np.abs(promised.values.sigma_sum / true.sigma_sum - 1.0)
print(
    f"the regressor is off by up to {off.max():.3f} dB per line, its σ by {100 * share.max():.1f} %"
)
assert off.max() < 0.043
assert share.max() < 0.037

# %%
# `deboom.surrogate_search` does all of this within a budget of rows: it places them, adds rows
# where the front is uncertain, shows the cross-validated error of each response, and lets the
# model judge the picks.

square = deboom.ResponseFunction(lambda x: (x - [0.9, 1.1]) ** 2, ("a", "b"), ("y", "z"), "dB")
costly = deboom.surrogate_search(square, square.design_space(), budget=100, draws=32)
costly.table
assert front.table["mean per line and vehicle [dB(A)]"].min() < today.mean()
