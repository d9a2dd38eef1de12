"""Figures of a running compressor, numbered as in the thesis."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from deboom.compressor.component_acceptance import DYNAMIC, STATIC
from deboom.compressor.source_load import case_name
from deboom.report.figures import MaskedPanel, masked_panels

if TYPE_CHECKING:
    from deboom.arrays import RealArray
    from deboom.compressor.unbalance import RouteResult, SweepUnbalance, Unbalance
    from deboom.compressor.unbalance_curve import UnbalanceCurve
    from deboom.study.compressor_unbalance import MeasuredUnbalance
    from deboom.study.compressor_unbalance_truth import UnbalanceTruth

SIZES = {STATIC: ("|u| [g mm]", 1e6), DYNAMIC: ("|u_d| [g mm²]", 1e9)}
"""Name of an unbalance → label of its axis, and its unit per SI unit."""
FROM_Y, FROM_Z, TRUTH = "from y", "from z", "truth"
CHANGE = "in operation over struck, minus 1"
WITHOUT_HOSES, WITH_HOSES = "hoses cut off", "hoses of the vehicle"


def figures_of(measured: MeasuredUnbalance) -> dict[str, bytes]:
    """Draw all pictures of one compressor; file stem → PNG."""
    found, chosen = measured.found, measured.found.chosen
    figures = {
        "figure_52_motion": motion(found),
        "figure_61a_static": over_speed(measured, STATIC),
        "figure_61b_dynamic": over_speed(measured, DYNAMIC),
        "figure_61c_forces": forces(chosen),
        "routes": routes(found, measured.truth),
        "mount_state": mount_state(found),
    }
    if measured.with_hoses is not None:
        figures["figure_62_hoses"] = hoses(chosen, measured.with_hoses, measured.truth)
    return figures


def motion(found: Unbalance) -> bytes:
    """Figure 52: acceleration of the virtual point, and what no rigid body explains of it."""
    shown = found.motions[0]
    lines, values = shown.calibrated.frequency, np.abs(shown.calibrated.values)
    left = {
        "places of the sheet": shown.consistency_by_sheet,
        "places the hammer test found": shown.consistency_calibrated,
    }
    return masked_panels(
        [
            MaskedPanel(
                "Acceleration of the virtual point",
                "[m/s²]",
                lines,
                dict(zip(("x", "y", "z"), values.T[:3], strict=True)),
                note=shown.sweep,
            ),
            MaskedPanel(
                "Rotational acceleration",
                "[rad/s²]",
                lines,
                dict(zip(("about x", "about y", "about z"), values.T[3:], strict=True)),
            ),
            MaskedPanel(
                "Share of the channels that no rigid body explains",
                "[%]",
                lines,
                {
                    name: 100 * np.sqrt(np.clip(1 - one.overall**2, 0, None))
                    for name, one in left.items()
                },
                logarithmic=True,
            ),
        ]
    )


def over_speed(measured: MeasuredUnbalance, name: str) -> bytes:
    """Figures 61a and 61b: an unbalance from y and from z, one panel per sweep."""
    label, unit = SIZES[name]
    chosen, limits = measured.found.chosen, measured.limits
    bounds = None
    if limits is not None:
        bounds = limits.static_unbalance if name == STATIC else limits.dynamic_unbalance
    panels = []
    for sweep in chosen.sweeps:
        curve = curve_of(sweep, name)
        curves: dict[str, RealArray] = {
            FROM_Y: unit * np.abs(curve.from_y.value),
            FROM_Z: unit * np.abs(curve.from_z.value),
        }
        curves |= true_curve(measured.truth, sweep, name)
        panels.append(
            MaskedPanel(
                f"{name[0].upper()}{name[1:]}, {sweep.sweep}",
                label,
                sweep.frequency,
                curves,
                ranges={
                    FROM_Y: (unit * curve.from_y.lower, unit * curve.from_y.upper),
                    FROM_Z: (unit * curve.from_z.lower, unit * curve.from_z.upper),
                },
                masked=masks(curve),
                levels={} if bounds is None else {"limit": unit * bounds.high},
                note=f"route {chosen.route.letter}",
            )
        )
    return masked_panels(panels, dashed=(TRUTH,))


def forces(chosen: RouteResult) -> bytes:
    """Figure 61c: what rotor and gas do inside, forces and moments."""
    panels = []
    for what, unit, first, labels in (
        ("Internal forces", "[N]", 0, ("F_x: gas", "F_y: unbalance", "F_z: unbalance")),
        ("Internal moments", "[N m]", 3, ("M_x: gas", "M_y: unbalance", "M_z: unbalance")),
    ):
        for sweep in chosen.sweeps:
            columns = slice(first, first + 3)
            size = np.abs(sweep.load[:, columns]).T
            low, high = sweep.load_lower[:, columns].T, sweep.load_upper[:, columns].T
            panels.append(
                MaskedPanel(
                    f"{what}, {sweep.sweep}",
                    unit,
                    sweep.frequency,
                    dict(zip(labels, size, strict=True)),
                    ranges={name: (low[k], high[k]) for k, name in enumerate(labels)},
                )
            )
    return masked_panels(panels, columns=min(2, len(chosen.sweeps)))


def hoses(without: RouteResult, with_hoses: RouteResult, truth: UnbalanceTruth | None) -> bytes:
    """Figure 62: mean of y and z with the hoses of the vehicle against hoses cut off."""
    panels, pairs = [], _by_pressure(without, with_hoses)
    for name, (label, unit) in SIZES.items():
        for first, second in pairs:
            joined = np.interp(
                first.frequency,
                second.frequency,
                np.abs(curve_of(second, name).mean),
                left=np.nan,
                right=np.nan,
            )
            curves = {
                WITHOUT_HOSES: unit * np.abs(curve_of(first, name).mean),
                WITH_HOSES: unit * joined,
            }
            curves |= true_curve(truth, first, name)
            panels.append(
                MaskedPanel(
                    f"{name[0].upper()}{name[1:]}, {case_name(first.pressure)}",
                    label,
                    first.frequency,
                    curves,
                    masked=masks(curve_of(first, name)),
                )
            )
    return masked_panels(panels, columns=min(2, len(pairs)), dashed=(TRUTH,))


def routes(found: Unbalance, truth: UnbalanceTruth | None, letters: str = "abcde") -> bytes:
    """Compare the routes over the first sweep: mean of y and z."""
    panels = []
    for name, (label, unit) in SIZES.items():
        curves: dict[str, RealArray] = {}
        for result in found.routes:
            if result.route.letter in letters:
                curve = curve_of(result.sweeps[0], name)
                curves[f"{result.route.letter}: {result.route.title}"] = unit * np.abs(curve.mean)
        sweep = found.chosen.sweeps[0]
        curves |= true_curve(truth, sweep, name)
        panels.append(
            MaskedPanel(
                f"{name[0].upper()}{name[1:]}, {sweep.sweep}", label, sweep.frequency, curves
            )
        )
    return masked_panels(panels, dashed=(TRUTH,))


def mount_state(found: Unbalance) -> bytes:
    """Draw the change of the mounts' dynamic stiffness from the hammer test to operation."""
    state = found.state
    half = 2 * state.curve_deviation
    panels = []
    for title, of in (("Real part", np.real), ("Imaginary part", np.imag)):
        value = 100 * of(state.curve)
        panels.append(
            MaskedPanel(
                title,
                "change of stiffness [%]",
                state.frequency,
                {CHANGE: value},
                ranges={CHANGE: (value - 100 * half, value + 100 * half)},
                levels={"as struck": 0.0},
            )
        )
    return masked_panels(panels, columns=2)


def curve_of(sweep: SweepUnbalance, name: str) -> UnbalanceCurve:
    """Return the static or the dynamic unbalance of a sweep."""
    return sweep.static if name == STATIC else sweep.dynamic


def masks(curve: UnbalanceCurve) -> dict[str, npt.NDArray[np.bool_]]:
    """Say which lines cannot be trusted, by reason."""
    return {reason.text: reason.lines for reason in curve.reasons}


def true_curve(
    truth: UnbalanceTruth | None, sweep: SweepUnbalance, name: str
) -> dict[str, RealArray]:
    """Size of the true unbalance in units of `SIZES`, the rotating gas force included, if known."""
    load = None if truth is None else truth.load_of(sweep)
    if load is None:
        return {}
    across = np.abs(load[:, 1 if name == STATIC else 5])
    return {TRUTH: SIZES[name][1] * across / (2 * np.pi * sweep.frequency) ** 2}


def _by_pressure(
    without: RouteResult, with_hoses: RouteResult
) -> list[tuple[SweepUnbalance, SweepUnbalance]]:
    first, second = _widest(without), _widest(with_hoses)
    return [(first[pressure], second[pressure]) for pressure in first if pressure in second]


def _widest(result: RouteResult) -> dict[float, SweepUnbalance]:
    """Take the sweep with the most lines at each pressure."""
    found: dict[float, SweepUnbalance] = {}
    for sweep in result.sweeps:
        known = found.get(sweep.pressure)
        if known is None or sweep.frequency.size > known.frequency.size:
            found[sweep.pressure] = sweep
    return found
