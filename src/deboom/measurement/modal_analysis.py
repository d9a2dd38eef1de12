"""Experimental modal analysis: the only door to sdypy-EMA, and what guards it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from types import SimpleNamespace
from typing import Any

import numpy as np
from scipy.linalg import toeplitz

from deboom.arrays import ComplexArray, RealArray
from deboom.errors import InputError
from deboom.measurement.channels import Frf
from deboom.measurement.coherence_gate import require_coherence
from deboom.measurement.frf_estimate import FrfEstimate
from deboom.measurement.modal_poles import (
    PoleCluster,
    StabilisationChart,
    StabilityLimits,
    stabilisation_chart,
)
from deboom.measurement.mode_shapes import phase_collinearity
from deboom.physics.frf import FrfForm

SMALLEST_ORDER = 4
LARGEST_ORDER = 20
"""Beyond, more poles belong to the noise than to a body below 140 Hz; judgement."""

LARGEST_CONDITION = 1e14
"""Of the normal equations of the numerators, close to what double precision carries [1]."""

LARGE_ERROR = 0.05
"""From here on a rebuilt FRF has missed something: a mode, the form, a band too narrow [1]."""
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
    form : FrfForm
        Of the FRF.
    outputs, inputs : tuple of str
        As in the FRF.
    residues : array, shape (n_mode, n_output, n_input)
        Complex modal constants of the receptance-like form.
    shapes : array, shape (n_mode, n_output)
        Complex, largest entry 1: the residues' part that all inputs share.
    lower_residual, upper_residual : array, shape (n_output, n_input)
        Modes below the band, L in ``−L/ω²``, and above it, U, of the receptance-like form.
    rank_one : array, shape (n_mode,)
        Share of the residues' energy that is one shape times one participation; far below 1 two
        modes share a pole [1].
    rebuilt : Frf
        From modes and residuals, on the lines of the fit.
    error : array, shape (n_output, n_input)
        Rms deviation of the rebuilt FRF from the measured one over the rms of the latter; near 1
        where a channel shows noise only [1].
    total_error : float
        The same of all FRFs together [1].
    """

    clusters: tuple[PoleCluster, ...]
    form: FrfForm
    outputs: tuple[str, ...]
    inputs: tuple[str, ...]
    residues: ComplexArray
    shapes: ComplexArray
    lower_residual: ComplexArray
    upper_residual: ComplexArray
    rank_one: RealArray
    rebuilt: Frf
    error: RealArray
    total_error: float

    @property
    def frequency(self) -> RealArray:
        """Natural frequencies, shape (n_mode,) [Hz]."""
        return np.array([cluster.frequency for cluster in self.clusters])

    @property
    def damping(self) -> RealArray:
        """Damping ratios, shape (n_mode,) [1]."""
        return np.array([cluster.damping for cluster in self.clusters])

    @property
    def complexity(self) -> RealArray:
        """How far each shape is from one phase, 1 − MPC, shape (n_mode,) [1]."""
        return 1 - phase_collinearity(self.shapes)

    @property
    def verdict(self) -> str:
        """One sentence on whether modes and residuals stand for what was measured."""
        share = f"modes and residuals leave {100 * self.total_error:.1f} % of the FRFs unexplained"
        if self.total_error <= LARGE_ERROR:
            return f"{share}."
        return (
            f"{share}, more than {100 * LARGE_ERROR:g} %: a mode is missing, the FRF is of another "
            "form than stated, or noise prevails; compare the rebuilt FRFs before using the shapes."
        )


def poles_over_orders(
    frf: Frf | FrfEstimate,
    form: FrfForm,
    band: tuple[float, float],
    largest_order: int | None = None,
    limits: StabilityLimits | None = None,
) -> StabilisationChart:
    """Estimate poles by least squares on a common denominator (LSCF) for growing orders.

    Parameters
    ----------
    frf : Frf or FrfEstimate
        Equidistant lines on whole multiples of their step; every pair of output and input takes
        part. An estimate must be coherent.
    form : FrfForm
        What the FRF is, a ratio of displacement, velocity or acceleration.
    band : tuple of float
        From, to; lines outside are not used [Hz].
    largest_order : int, optional
        Of the polynomial; twice as many poles. Left out, as high as the band carries, 20 at most.
    limits : StabilityLimits, optional

    Returns
    -------
    StabilisationChart

    Raises
    ------
    InputError
        sdypy-EMA is not installed; FRFs without coherence; lines that are not equidistant; a band
        outside the lines or with fewer lines than unknowns; an order that the band does not carry;
        apparent mass or another inverse form.

    Notes
    -----
    Which form? Modes come as ``Σ R_n/(jω − s_n)`` where motion stands over load. A displacement per
    force, a pressure per force (`Pa/N`: the air follows displacements) and an acceleration per
    volume acceleration (two derivatives above and below) are all receptance-like; an acceleration
    per force is an inertance.

    The lines below the band are unknown to the polynomial in ``z``, whose numerators are fixed by
    the band alone: the closer the band begins to its end, the lower the order that it carries.
    """
    measured = _coherent(frf, band)
    if largest_order is None:
        largest_order = _order_carried(measured, band)
    model = _ema_model(measured, form, band, largest_order)
    model.get_poles("lscf", show_progress=False)
    by_order = {
        len(poles) // 2: np.asarray(poles, dtype=complex)
        for poles in model.all_poles
        if len(poles) // 2 >= SMALLEST_ORDER
    }
    return stabilisation_chart(by_order, band, limits)


def modal_model(
    frf: Frf | FrfEstimate,
    form: FrfForm,
    band: tuple[float, float],
    clusters: Sequence[PoleCluster],
) -> ModalModel:
    """Estimate modal constants and residuals for known poles, and rebuild the FRF from them.

    Parameters
    ----------
    frf : Frf or FrfEstimate
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
    frf = _coherent(frf, band)
    model = _ema_model(frf, form, band, SMALLEST_ORDER)
    chosen = SimpleNamespace(
        pole_ind=[[0, number] for number in range(len(kept))],
        all_poles=[[cluster.pole for cluster in kept]],
    )
    rebuilt, constants = model.get_constants(
        whose_poles=chosen,
        f_lower=band[0],
        f_upper=float(model.freq[-1]),
        upper_r=True,
        lower_r=True,
    )
    pairs = len(frf.outputs), len(frf.inputs)
    lines = (frf.frequency >= band[0]) & (frf.frequency <= band[1])
    # the library holds one row per pair of output and input, on lines of its own
    inside = np.isin(model.freq, frf.frequency[lines])
    values = np.moveaxis(np.asarray(rebuilt).reshape(*pairs, -1), -1, 0)[inside]
    residues = np.moveaxis(np.asarray(constants).reshape(*pairs, -1), -1, 0)
    left, singular, _ = np.linalg.svd(residues, full_matrices=False)
    leading = left[:, :, 0]
    largest = np.take_along_axis(leading, np.abs(leading).argmax(axis=1)[:, np.newaxis], axis=1)
    measured = frf.values[lines]
    deviation = np.sum(np.abs(values - measured) ** 2, axis=0)
    energy = np.sum(np.abs(measured) ** 2, axis=0)
    return ModalModel(
        kept,
        form,
        frf.outputs,
        frf.inputs,
        residues,
        leading / largest,
        np.asarray(model.LR).reshape(pairs),
        np.asarray(model.UR).reshape(pairs),
        singular[:, 0] ** 2 / np.sum(singular**2, axis=1),
        Frf(frf.frequency[lines], values, frf.outputs, frf.inputs, frf.unit),
        np.sqrt(deviation / np.where(energy > 0, energy, 1.0)),
        float(np.sqrt(deviation.sum() / energy.sum())),
    )


def _coherent(frf: Frf | FrfEstimate, band: tuple[float, float]) -> Frf:
    if isinstance(frf, Frf):
        return frf
    require_coherence(frf, band)
    return frf.frf


def _lines_of(frf: Frf, band: tuple[float, float]) -> tuple[int, int, float]:
    """Lines from 0 Hz to the band's begin, and to its end, and their step [Hz]; checked."""
    steps = np.diff(frf.frequency)
    if not steps.size or not np.allclose(steps, steps[0], rtol=1e-6, atol=0):
        raise InputError("modal analysis needs equidistant lines: interpolating would bend modes")
    step = float(steps.mean())
    number = frf.frequency / step
    if np.abs(number - np.round(number)).max() > 0.01:
        raise InputError(
            f"modal analysis needs lines on whole multiples of their step, {step:g} Hz, but the "
            f"first one is at {frf.frequency[0]:g} Hz"
        )
    low, high = band
    if not 0 < low < high:
        raise InputError(f"a band from {low:g} to {high:g} Hz: it begins above 0 Hz and ends later")
    if not frf.frequency[0] <= low < high <= frf.frequency[-1]:
        raise InputError(
            f"the band {low:g}-{high:g} Hz does not lie within the lines, "
            f"{frf.frequency[0]:g}-{frf.frequency[-1]:g} Hz"
        )
    end = int(np.searchsorted(frf.frequency, high, side="right"))
    return round(low / step), round(frf.frequency[end - 1] / step), step


def _condition(unknown: int, total: int, order: int) -> float:
    """Condition number of the numerators' normal equations when the first lines are unknown."""
    lines = np.zeros(total + 1)
    lines[:unknown] = 1.0
    first = -np.fft.irfft(lines, n=2 * total)[: 2 * order + 1]
    first[0] += 1.0
    return float(np.linalg.cond(toeplitz(first)))


def _order_carried(frf: Frf, band: tuple[float, float]) -> int:
    unknown, total, _ = _lines_of(frf, band)
    largest = min(LARGEST_ORDER, (total - unknown) // 4)
    for order in range(largest, SMALLEST_ORDER, -1):
        if _condition(unknown, total, order) <= LARGEST_CONDITION:
            return order
    raise InputError(
        f"the band {band[0]:g}-{band[1]:g} Hz carries no polynomial above order {SMALLEST_ORDER}: "
        "begin lower, or take more lines"
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
        name = form.name.lower().replace("_", " ")
        raise InputError(
            f"modal analysis reads motion per load, not {name}: convert() the whole matrix first"
        )
    unknown, total, step = _lines_of(frf, band)
    low, high = band
    n_lines = int(np.sum((frf.frequency >= low) & (frf.frequency <= high)))
    if n_lines < 2 * order:
        raise InputError(
            f"{n_lines} lines between {low:g} and {high:g} Hz do not fix a polynomial of order "
            f"{order}: use a wider band, more lines or a lower order"
        )
    if order > SMALLEST_ORDER and _condition(unknown, total, order) > LARGEST_CONDITION:
        raise InputError(
            f"the band {low:g}-{high:g} Hz does not carry a polynomial of order {order} in double "
            "precision: begin lower, or use a lower order"
        )
    # the library drops the line at its upper limit: it gets one more, which it never reads
    end = int(np.searchsorted(frf.frequency, high, side="right"))
    frequency = np.append(frf.frequency[:end], frf.frequency[end - 1] + step)
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
