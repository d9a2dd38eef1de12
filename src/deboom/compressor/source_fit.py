"""All speeds and pressures at once: unbalance, gas forces and mounts by weighted least squares."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from deboom.arrays import ComplexArray, RealArray
from deboom.compressor.source_problem import N_ROTOR, SourceProblem

if TYPE_CHECKING:
    from deboom.compressor.operating_load import OperatingLoad
    from deboom.compressor.operating_stiffness import StiffnessChange
    from deboom.compressor.route_model import RouteModel
    from deboom.compressor.source_structure import GasLaw
    from deboom.compressor.unbalance_load import RotationSense

MOUNTS_BELOW = 60.0
"""Where mounts that differ from their model show [Hz]."""
EXPLAINED = 1.05
"""Reduced χ there up to which the model of the mounts is good enough [1]."""
SMALLEST_MISMATCH, LARGEST_MISMATCH = 1e-4, 1.0
MISMATCH_PASSES = 2


@dataclass(frozen=True, eq=False)
class SourceFit:
    """Most probable source, mounts and errors of the route.

    Parameters
    ----------
    sense : RotationSense
    change : StiffnessChange
        Of the mounts.
    gas : GasLaw
    pressure : array, shape (n_pressure,)
        Each once, rising [Pa].
    values : array, shape (n_unknown,)
        Rotor, gas, mounts, errors of the route.
    covariance : array, shape (n_unknown, n_unknown)
        Posterior.
    line_values : array, shape (n_unknown,)
        As `values`, with the change of the mounts that comes nearest to what they do at all lines;
        the same where there is no `mismatch`.
    line_covariance : array, shape (n_unknown, n_unknown)
        Of `line_values`.
    n_gas, n_change : int
        Of real unknowns.
    reduced_chi : float
        Rms of the residuals in units of their noise, nothing allowed for `mismatch` [1].
    mismatch : float
        Relative change of the mounts' stiffness, 1 σ per direction, that `change` cannot describe
        and that the weights allow for; 0 where noise explains the residuals [1].
    converged : bool
    residuals : tuple of array, shape (n_frequency, 6)
        What no source explains, one array per sweep [N, N m].
    whitened : tuple of array, shape (n_frequency, 6)
        The same in units of the noise of one part, mixed where loads share their lines; not a
        number outside of the band [1].
    """

    sense: RotationSense
    change: StiffnessChange
    gas: GasLaw
    pressure: RealArray
    values: RealArray
    covariance: RealArray
    line_values: RealArray
    line_covariance: RealArray
    n_gas: int
    n_change: int
    reduced_chi: float
    mismatch: float
    converged: bool
    residuals: tuple[ComplexArray, ...]
    whitened: tuple[ComplexArray, ...]

    @property
    def rotor(self) -> ComplexArray:
        """Static and dynamic unbalance [kg m, kg m²]."""
        return self.values[:N_ROTOR].view(complex)

    @property
    def gas_slice(self) -> slice:
        """Where the unknowns of the gas stand."""
        return slice(N_ROTOR, N_ROTOR + self.n_gas)

    @property
    def change_slice(self) -> slice:
        """Where those of the mounts stand."""
        return slice(N_ROTOR + self.n_gas, N_ROTOR + self.n_gas + self.n_change)

    @property
    def error_slice(self) -> slice:
        """Where those of the route's errors stand."""
        return slice(N_ROTOR + self.n_gas + self.n_change, self.values.size)

    @property
    def gas_values(self) -> ComplexArray:
        """Axial force, moment and rotating force, shape (n_pressure, 3) [N, N m, N]."""
        return self.gas.gas(self.values[self.gas_slice])

    @property
    def schwarz(self) -> float:
        """Schwarz's criterion of what the mounts are said to do: the smaller the better [1].

        Two fits of the same sweeps differ in χ² and in the number of unknowns of the mounts.
        """
        count = 2 * sum(int(np.count_nonzero(np.isfinite(part))) for part in self.whitened)
        return float(count * self.reduced_chi**2 + self.n_change * np.log(count))

    def gas_derivatives(self) -> ComplexArray:
        """By the unknowns of the gas, shape (n_gas, n_pressure, 3)."""
        return self.gas.derivatives(self.values[self.gas_slice])


def fit_source(
    model: RouteModel,
    loads: Sequence[OperatingLoad],
    sense: RotationSense,
    gas: GasLaw,
    change: StiffnessChange,
    band: tuple[float, float],
) -> SourceFit:
    """Find what turns and what the gas does, out of all sweeps together.

    Parameters
    ----------
    model : RouteModel
        That the loads were made with.
    loads : sequence of OperatingLoad
        At least one.
    sense : RotationSense
    gas : GasLaw
        How pressures hang together; the unbalance is the same at all of them.
    change : StiffnessChange
        What the mounts may have done since they were struck.
    band : (float, float)
        Lines that take part, both ends included [Hz].

    Returns
    -------
    SourceFit

    Raises
    ------
    InputError
        Fewer than six lines in the band.

    Notes
    -----
    ``(AM − Σ c_k C_k − Σ n_k D_k) s = B x + e``: thesis, eq. 36, solved for all lines instead of
    one; C_k are changes of the mounts, D_k errors of the route with unit normal n_k, e the noise of
    sweep and hammer test. To take the errors as unknowns with their prior is the same as to weight
    with their full covariance, which ties every line to every other. Where mounts in operation do
    what no C_k describes, the lines below 60 Hz get the share of it into their weights that brings
    their χ to one.
    """
    problem = SourceProblem(model, loads, sense, gas, change, band)
    values, covariance, converged = problem.solve(problem.start(), 0.0)
    reduced_chi, mismatch = problem.reduced_chi(values, 0.0), 0.0
    for _ in range(MISMATCH_PASSES):
        if problem.reduced_chi(values, mismatch, MOUNTS_BELOW) <= EXPLAINED and mismatch == 0:
            break
        mismatch = _mismatch(problem, values)
        values, covariance, converged = problem.solve(values, mismatch)
    by_line = (
        problem.change_alone(values, covariance, mismatch) if mismatch > 0 else (values, covariance)
    )
    return SourceFit(
        sense,
        change,
        gas,
        problem.pressure,
        values,
        covariance,
        *by_line,
        problem.n_gas,
        problem.deviations.size,
        reduced_chi,
        mismatch,
        converged,
        *problem.residuals(values, mismatch),
    )


def _mismatch(problem: SourceProblem, values: RealArray) -> float:
    """Change of the mounts, direction by direction, that explains the residuals below 60 Hz."""
    low, high = SMALLEST_MISMATCH, LARGEST_MISMATCH
    chi = problem.chi_over_mismatch(values, MOUNTS_BELOW)
    for _ in range(10):
        middle = float(np.sqrt(low * high))
        if chi(middle) > 1:
            low = middle
        else:
            high = middle
    return high
