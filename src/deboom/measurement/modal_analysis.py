"""Experimental modal analysis: the only door to sdypy-EMA, and what guards it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from types import SimpleNamespace
from typing import Any

import numpy as np

from deboom.errors import InputError
from deboom.measurement.channels import Frf
from deboom.measurement.modal_poles import (
    PoleCluster,
    StabilisationChart,
    StabilityLimits,
    stabilisation_chart,
)
from deboom.physics.arrays import ComplexArray, RealArray
from deboom.physics.frf import FrfForm

SMALLEST_ORDER = 4
_FORM_NAMES = {
    FrfForm.RECEPTANCE: "receptance",
    FrfForm.MOBILITY: "mobility",
    FrfForm.INERTANCE: "accelerance",
}


@dataclass(frozen=True, eq=False)
class ModalModel:
    """Modes of a structure and how well they rebuild what was measured.

    Parameters
    ----------
    clusters : tuple of PoleCluster
        One per mode.
    outputs, inputs : tuple of str
        As in the FRF.
    residues : array, shape (n_mode, n_output, n_input)
        Complex modal constants of the receptance-like form.
    shapes : array, shape (n_mode, n_output)
        Complex, largest entry 1: the residues' part that all inputs share.
    rank_one : array, shape (n_mode,)
        Share of the residues' energy that is one shape times one participation; far below 1 two
        modes share a pole [1].
    rebuilt : Frf
        From modes and residuals, on the lines of the fit.
    error : array, shape (n_output, n_input)
        Rms deviation of the rebuilt FRF from the measured one over the rms of the latter [1].
    """

    clusters: tuple[PoleCluster, ...]
    outputs: tuple[str, ...]
    inputs: tuple[str, ...]
    residues: ComplexArray
    shapes: ComplexArray
    rank_one: RealArray
    rebuilt: Frf
    error: RealArray

    @property
    def frequency(self) -> RealArray:
        """Natural frequencies, shape (n_mode,) [Hz]."""
        return np.array([cluster.frequency for cluster in self.clusters])

    @property
    def damping(self) -> RealArray:
        """Damping ratios, shape (n_mode,) [1]."""
        return np.array([cluster.damping for cluster in self.clusters])


def poles_over_orders(
    frf: Frf,
    form: FrfForm,
    band: tuple[float, float],
    largest_order: int = 14,
    limits: StabilityLimits | None = None,
) -> StabilisationChart:
    """Estimate poles by least squares on a common denominator (LSCF) for growing orders.

    Parameters
    ----------
    frf : Frf
        Equidistant lines; every pair of output and input takes part.
    form : FrfForm
        What the FRF is, a ratio of displacement, velocity or acceleration.
    band : tuple of float
        From, to; lines outside are not used [Hz].
    largest_order : int
        Of the polynomial; twice as many poles.
    limits : StabilityLimits, optional

    Returns
    -------
    StabilisationChart

    Raises
    ------
    InputError
        sdypy-EMA is not installed; lines that are not equidistant; a band outside the lines or
        with fewer lines than unknowns; apparent mass or another inverse form.
    """
    model = _ema_model(frf, form, band, largest_order)
    model.get_poles("lscf", show_progress=False)
    by_order = {
        len(poles) // 2: np.asarray(poles, dtype=complex)
        for poles in model.all_poles
        if len(poles) // 2 >= SMALLEST_ORDER
    }
    return stabilisation_chart(by_order, band, limits)


def modal_model(
    frf: Frf, form: FrfForm, band: tuple[float, float], clusters: Sequence[PoleCluster]
) -> ModalModel:
    """Estimate modal constants and residuals for known poles, and rebuild the FRF from them.

    Parameters
    ----------
    frf : Frf
        As for the poles.
    form : FrfForm
        What the FRF is.
    band : tuple of float
        From, to; lines of the fit [Hz].
    clusters : sequence of PoleCluster
        The modes to keep.

    Returns
    -------
    ModalModel

    Raises
    ------
    InputError
        As `poles_over_orders`; no mode; two modes with one pole.

    Notes
    -----
    Least squares in the frequency domain (LSFD), with a lower and an upper residual for the modes
    outside the band. Shapes are the leading left singular vectors of the residues.
    """
    kept = tuple(clusters)
    if not kept:
        raise InputError("a modal model needs at least one mode")
    for first, second in pairwise(kept):
        if abs(second.pole - first.pole) < 1e-3 * abs(first.pole):
            raise InputError(
                f"two modes share the pole at {first.frequency:.2f} Hz: keep one of them"
            )
    model = _ema_model(frf, form, band, SMALLEST_ORDER)
    chosen = SimpleNamespace(
        pole_ind=[[0, number] for number in range(len(kept))],
        all_poles=[[cluster.pole for cluster in kept]],
    )
    rebuilt, constants = model.get_constants(
        whose_poles=chosen, f_lower=band[0], f_upper=float(model.freq[-1]), upper_r=True, lower_r=True
    )
    n_outputs, n_inputs = len(frf.outputs), len(frf.inputs)
    lines = (frf.frequency >= band[0]) & (frf.frequency <= band[1])
    # the library holds one row per pair of output and input, on lines of its own
    inside = np.isin(model.freq, frf.frequency[lines])
    values = np.moveaxis(np.asarray(rebuilt).reshape(n_outputs, n_inputs, -1), -1, 0)[inside]
    residues = np.moveaxis(np.asarray(constants).reshape(n_outputs, n_inputs, -1), -1, 0)
    left, singular, _ = np.linalg.svd(residues, full_matrices=False)
    leading = left[:, :, 0]
    largest = np.take_along_axis(leading, np.abs(leading).argmax(axis=1)[:, np.newaxis], axis=1)
    measured = frf.values[lines]
    deviation = np.sum(np.abs(values - measured) ** 2, axis=0)
    return ModalModel(
        kept,
        frf.outputs,
        frf.inputs,
        residues,
        leading / largest,
        singular[:, 0] ** 2 / np.sum(singular**2, axis=1),
        Frf(frf.frequency[lines], values, frf.outputs, frf.inputs, frf.unit),
        np.sqrt(deviation / np.sum(np.abs(measured) ** 2, axis=0)),
    )


def _ema_model(frf: Frf, form: FrfForm, band: tuple[float, float], order: int) -> Any:
    """Model of sdypy-EMA behind checks of what it takes for granted."""
    try:
        from sdypy import EMA
    except ImportError:
        raise InputError(
            'modal analysis needs sdypy-EMA: install deboom with the extra "modal"'
        ) from None
    if form not in _FORM_NAMES:
        raise InputError(f"modal analysis reads motion per load, not {form.value}")
    steps = np.diff(frf.frequency)
    if not np.allclose(steps, steps[0], rtol=1e-6, atol=0):
        raise InputError("modal analysis needs equidistant lines: interpolating would bend modes")
    low, high = band
    if not frf.frequency[0] <= low < high <= frf.frequency[-1]:
        raise InputError(
            f"the band {low:g}-{high:g} Hz does not lie within the lines, "
            f"{frf.frequency[0]:g}-{frf.frequency[-1]:g} Hz"
        )
    n_lines = int(np.sum((frf.frequency >= low) & (frf.frequency <= high)))
    if n_lines < 2 * order:
        raise InputError(
            f"{n_lines} lines between {low:g} and {high:g} Hz do not fix a polynomial of order "
            f"{order}: use a wider band, more lines or a lower order"
        )
    # the library drops the line at its upper limit: it gets one more, which it never reads
    end = int(np.searchsorted(frf.frequency, high * (1 + 1e-12), side="right"))
    frequency = np.append(frf.frequency[:end], frf.frequency[end - 1] + steps[0])
    rows = np.moveaxis(frf.values[:end], 0, -1).reshape(-1, end)
    rows = np.column_stack([rows, np.zeros(len(rows))])
    return EMA.Model(
        frf=rows,
        freq=frequency,
        lower=low,
        upper=float(frequency[-1]),
        pol_order_high=order,
        frf_form=_FORM_NAMES[form],
    )
