"""
Models that are not deboom's
============================

A Gaussian process of scikit-learn takes the place of the booming model: whatever turns designs
into responses gives a front, an index and a tolerance, such as the table of a supplier's Excel
sheet. `deboom.surrogate_search` does all of this within a budget of rows of a costly model.
"""

import numpy as np
from sklearn.gaussian_process import GaussianProcessRegressor
from sklearn.gaussian_process.kernels import RBF, ConstantKernel
from sklearn.pipeline import make_pipeline
from sklearn.preprocessing import MinMaxScaler

import deboom

# %%
# A regressor that learned 128 designs of the platform's model. Its inputs are stiffnesses in N/mm.
# A scaler brings them to 0 to 1, and the kernel has a length for each: with the default kernel, of
# one fixed length, the prediction would be flat.

model = deboom.read_platform("u06").model(vehicles="U06", band=(24, 40), motion="coupled")
space = model.design_space(bounds=0.20)
wide = model.design_space(bounds=0.30)  # parts scatter beyond the bounds of the search
rows = deboom.doe(model, wide, n=128, seed=1).doe
today = np.linspace(150.0, 1800.0, space.n_variables)  # [N/mm]
kernel = ConstantKernel(1.0, (1e-3, 1e5)) * RBF(np.ones(space.n_variables), (0.05, 1e3))
process = GaussianProcessRegressor(kernel, alpha=1e-8, normalize_y=True, random_state=1)
regressor = make_pipeline(MinMaxScaler(), process)
regressor.fit(rows.designs * today, rows.responses)

# %%
# The front that it promises.

learned = deboom.ResponseFunction(
    lambda factors: regressor.predict(factors * today),
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
fronts = {
    name: promised.per_line * np.array([values.mean_sum, values.sigma_sum])
    for name, values in (("promised", promised.values), ("as the model says", true))
}
deboom.plot.fronts(
    fronts, {}, {}, mean_label="mean level per line [dB(A)]", sigma_label="its σ [dB]"
)
off = np.abs(fronts["promised"] - fronts["as the model says"]).max(axis=1)
print(f"the regressor is off by up to {off[0]:.3f} dB per line, its σ by {off[1]:.3f} dB")
