"""Electric cars of the virtual bench.

Five frozen cars and fleets drawn from the same prior, none of them selected: a compressor on its
mounts and hoses on a body that gives way. The gain of the hoses is the level of the A-weighted
energy in the band with the car's hoses minus that with long soft ones, at the truth, hoses as
drawn; the thesis saw 5 to 10 dB in its one car, which is an observation to compare with and not a
target. Noise transfer functions are those of forces and moments at three mounts and two hose ends
out of nine impacts and three triaxial accelerometers around each, at all levels of calibration.
"""

from __future__ import annotations

import numpy as np

from claims import Claim, between, draws
from deboom.bench.compressor_rig import true_source
from deboom.bench.compressor_truth import CompressorPlan, drawn_hoses, true_compressor
from deboom.bench.electric_car import ElectricCarBody, draw_fleet, frozen_fleet, run_car
from deboom.choices import CompressorCase
from deboom.physics.sound_level import spl

FLEETS = range(1, 1 + draws(60))
SEEDS = range(1, 7)
LINES = np.arange(20.0, 140.5, 1.0)
HOSE_BAND, BELOW = (90.0, 140.0), (20.0, 80.0)
"""Where the thesis hears its hoses, and where it does not [Hz]."""
CAR_SEED = 1


def claims() -> list[Claim]:
    """Measure everything afresh."""
    drawn = [level for seed in FLEETS for level in _levels(draw_fleet(seed))]
    return _gains(np.array(drawn), np.array(_levels(frozen_fleet())))


def _levels(fleet: dict[str, ElectricCarBody]) -> list[np.ndarray]:
    """Level at the ear of each car, with standard and with soft hoses, (2, n_line) [dB(A)]."""
    plan = CompressorPlan(CompressorCase.TABLE11)
    compressor = true_compressor(plan, np.random.default_rng(CAR_SEED))
    return [
        np.array(
            [
                spl(run_car(car, compressor, true_source(), LINES, hoses).pressure, LINES)
                for hoses in (drawn_hoses(), ())
            ]
        )
        for car in fleet.values()
    ]


def _gains(drawn: np.ndarray, frozen: np.ndarray) -> list[Claim]:
    low, high = HOSE_BAND
    lines = _spread(-np.diff(drawn, axis=1)[..., _inside(HOSE_BAND)])[0]
    cars = ", ".join(f"{value:.1f}" for value in _gain(frozen, HOSE_BAND))
    words, middle = _spread(_gain(drawn, HOSE_BAND))
    _, middle_below = _spread(_gain(drawn, BELOW))
    what = f"median and 10-90 % of {len(drawn)} cars in {len(FLEETS)} drawn fleets [dB]"
    return [
        Claim(
            f"hose gain in {low:g}-{high:g} Hz, {what}",
            "median above 0; the thesis's one car: 5 to 10",
            f"{words}; line by line {lines}; frozen cars {cars}",
            middle > 0,
        ),
        between(f"hose gain in {BELOW[0]:g}-{BELOW[1]:g} Hz, {what}", (-1, 1), middle_below, 1),
    ]


def _inside(band: tuple[float, float]) -> np.ndarray:
    return (band[0] <= LINES) & (band[1] >= LINES)


def _gain(levels: np.ndarray, band: tuple[float, float]) -> np.ndarray:
    """Level of the energy in a band with hoses minus without, (n_car,) [dB]."""
    energy = np.sum(10 ** (levels[..., _inside(band)] / 10), axis=-1)
    return 10 * np.log10(energy[:, 0] / energy[:, 1])


def _spread(values: np.ndarray) -> tuple[str, float]:
    low, middle, high = np.percentile(values, [10, 50, 90])
    return f"{middle:.1f} ({low:.1f} … {high:.1f})", float(middle)
