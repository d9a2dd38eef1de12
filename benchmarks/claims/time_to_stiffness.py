"""From time data to dynamic stiffness.

One run over time of 6 s (gear 5, full load, order 1.5 from 37.5 to 52.5 Hz at 2.5 Hz/s, tacho with
two pulses) goes the way of ``deboom orders`` into its campaign and is then characterised like any
other run. The same run as order spectra stands beside it: both share the errors of
sensors and shaker, so their difference is what time data and order tracking cost. Rms over the
lines, median over the benches.
"""

from __future__ import annotations

import tempfile
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from pathlib import Path

import numpy as np
from threadpoolctl import threadpool_limits

from claims import Claim, draws
from deboom.arrays import ComplexArray
from deboom.bench.campaign import CampaignPlan, TimeRunPlan
from deboom.bench.campaign_writer import write_campaign
from deboom.bench.operating_run import PlannedRun
from deboom.files.campaign import read_campaign
from deboom.measurement.channels import Spectrum
from deboom.measurement.order_tracking import OrderTracking, TrackingOptions
from deboom.mounts.characterise import measuring_chains
from deboom.mounts.measuring_chain import body_record
from deboom.mounts.operating_map import OperatingMap, operating_maps
from deboom.study.campaigns import orders_into_campaign

SEEDS = range(1, 1 + draws(2))
TIME_RUN = "g5_wot220_time"
ORDER_RUN = "g5_wot220"
LINES = np.arange(38.5, 51.6, 0.25)
RUNS = (
    PlannedRun(5, 220.0, full_load=True),
    PlannedRun(5, 60.0, full_load=False),
    PlannedRun(5, 180.0, full_load=False),
    PlannedRun(6, 140.0, full_load=False),
    PlannedRun(7, 100.0, full_load=False),
)
METHODS = {
    method: TrackingOptions(method, lowest_rpm=1540.0, highest_rpm=2060.0)
    for method in OrderTracking
}
_Stiffness = dict[str, tuple[float, float, float]]
_Found = dict[OrderTracking, tuple[float, float, float, _Stiffness]]


def claims() -> list[Claim]:
    """Measure everything afresh; two processes."""
    with ProcessPoolExecutor(2, mp_context=get_context("spawn")) as pool:
        benches = list(pool.map(_bench, SEEDS))
    rows = []
    for method in OrderTracking:
        amplitude, degrees, smear = np.max([bench[method][:3] for bench in benches], axis=0)
        rows.append(
            Claim(
                f"largest error of amplitude; phase, channels above a tenth of the largest; smear: "
                f"{method.value}",
                "at most 1 %; 1°; said",
                f"{100 * amplitude:.2f} %; {degrees:.2f}°; {smear:.1f} Hz",
                bool(amplitude <= 0.01 and degrees <= 1),
            )
        )
        rows += _stiffness_claims(method, [bench[method][3] for bench in benches])
    return rows


def _stiffness_claims(method: OrderTracking, benches: list[_Stiffness]) -> list[Claim]:
    median = {n: np.median([bench[n] for bench in benches], axis=0) for n in benches[0]}
    rows = []
    for axis, truth, beside in (("x", 0.03, 0.005), ("z", 0.10, 0.01), ("y", None, None)):
        found = {name: value for name, value in median.items() if name.endswith(f" {axis}")}
        of_time, of_orders, difference = np.array(list(found.values())).T
        rows.append(
            Claim(
                f"K from time data, {method.value}, {', '.join(found)}: against the truth; the "
                "order spectra's K against the truth; against the order spectra's K [%]",
                "no claim"
                if truth is None
                else f"at most {100 * truth:.0f}; -; {100 * beside:.1f}",
                "; ".join(
                    ", ".join(f"{100 * value:.2f}" for value in values)
                    for values in (of_time, of_orders, difference)
                ),
                truth is None or bool(np.all(of_time <= truth) and np.all(difference <= beside)),
            )
        )
    return rows


def _bench(seed: int) -> _Found:
    plan = CampaignPlan(("M1",), RUNS, frequency=LINES, time_run=TimeRunPlan())
    with tempfile.TemporaryDirectory() as temporary, threadpool_limits(1):
        folder = write_campaign(Path(temporary) / "campaign", seed, plan)
        tracked = {
            method: orders_into_campaign(folder, TIME_RUN, options, method.value)[0]
            for method, options in METHODS.items()
        }
        with np.load(folder / "truth" / f"{TIME_RUN}.npz") as data:
            rows = np.searchsorted(data["frequency"], LINES - 1e-6)
            channels = data["channels"].tolist()
            stiffness = dict(zip(channels, data["stiffness"][rows].T, strict=True))
            spectra = (data["acceleration"][rows], data["cell_force"][rows])
        campaign = read_campaign(folder)
        chains = measuring_chains(campaign)

        def maps(run: str) -> dict[str, OperatingMap]:
            runs = [one for one in campaign.runs if one.name == run]
            bodies = [chain.alignment.body for chain in chains]
            return operating_maps(
                chains, [body_record(body, runs, campaign.tolerances) for body in bodies]
            )

        beside = maps(ORDER_RUN)
        return {
            method: (
                *_errors((one.run.acceleration, one.run.cell_force), spectra),
                float(one.order.smear.max()),
                {
                    name: (
                        _rms(lines.stiffness / _truth(lines, stiffness)),
                        _rms(beside[name].stiffness / _truth(lines, stiffness)),
                        _rms(lines.stiffness / beside[name].stiffness),
                    )
                    for name, lines in maps(method.value).items()
                },
            )
            for method, one in tracked.items()
        }


def _errors(
    found: tuple[Spectrum, Spectrum], truth: tuple[ComplexArray, ComplexArray]
) -> tuple[float, float]:
    """Largest error of amplitude [1] and phase [deg] over all lines of the loud channels."""
    ratios = []
    for spectrum, true in zip(found, truth, strict=True):
        loud = np.abs(true) > 0.1 * np.abs(true).max()
        ratios.append(spectrum.values[loud] / true[loud])
    ratio = np.concatenate(ratios)
    return float(np.abs(np.abs(ratio) - 1).max()), float(np.rad2deg(np.abs(np.angle(ratio))).max())


def _truth(lines: OperatingMap, stiffness: dict[str, ComplexArray]) -> ComplexArray:
    pieces = [label.partition(" ")[2] for label in dict.fromkeys(str(run) for run in lines.run)]
    names = [" ".join(filter(None, (lines.mount, piece, lines.axis))) for piece in pieces]
    return np.concatenate([stiffness[name] for name in names])


def _rms(ratio: ComplexArray) -> float:
    return float(np.sqrt(np.mean(np.abs(ratio - 1) ** 2)))
