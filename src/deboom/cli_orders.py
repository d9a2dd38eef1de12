"""The command line of order tracking: a run over time becomes an operating run."""

from __future__ import annotations

from enum import Enum
from pathlib import Path
from typing import Annotated

import typer


class Method(Enum):
    """How the order is taken out of the time record."""

    VOLD_KALMAN = "vold-kalman"
    RESAMPLING = "resampling"


def orders(
    campaign: Annotated[Path, typer.Argument(help="Folder with campaign.toml.")],
    time_run: Annotated[
        str, typer.Argument(help="One of its [[time_runs]], such as g5_wot220_time.")
    ],
    name: Annotated[
        str | None, typer.Option(help="Of the operating run; by default that of the time run.")
    ] = None,
    method: Annotated[Method, typer.Option(help="Of order tracking.")] = Method.VOLD_KALMAN,
    bandwidth: Annotated[
        float, typer.Option(help="Of the Vold-Kalman filter, full half-power width [Hz].")
    ] = 3.0,
    revolutions: Annotated[
        float, typer.Option(help="Of the window of resampling; a multiple of 4.")
    ] = 12.0,
    other_order: Annotated[
        list[float] | None,
        typer.Option(
            help="A strong order beside the dominant one, for the filter; repeatable. By default "
            "0.5, and twice and four times the dominant order."
        ),
    ] = None,
    rpm_from: Annotated[
        float | None, typer.Option(help="Lowest line [1/min]; by default the run's.")
    ] = None,
    rpm_to: Annotated[
        float | None, typer.Option(help="Highest line [1/min]; by default the run's.")
    ] = None,
    rpm_step: Annotated[float, typer.Option(help="Between lines [1/min].")] = 10.0,
) -> None:
    """Make an operating run of a run over time, and add it to its campaign.

    The tacho is repaired and gives the shaft's angle; the dominant order of all accelerometers and
    cells becomes complex spectra over engine speed, phase to the tacho, with engine torque and
    static forces at the same lines. The run gets a file (UFF) and an entry in campaign.toml;
    nothing is overwritten. `deboom characterise` uses it like any other run:

    deboom orders CAMPAIGN g5_wot220_time, then deboom characterise CAMPAIGN --library mounts.db.
    Both in one: deboom characterise CAMPAIGN --library mounts.db --time-runs.

    The output says what the spectra resolve: bandwidth, the finest detail that the run-up leaves,
    and what noise and neighbouring orders pretend.
    """
    from deboom.measurement.tracked_run import OrderTracking, TrackingOptions
    from deboom.study.order_runs import described_orders, orders_into_campaign
    from deboom.study.runner import one_sentence_errors

    with one_sentence_errors():
        options = TrackingOptions(
            method=OrderTracking(method.value),
            bandwidth=bandwidth,
            revolutions=revolutions,
            other_orders=tuple(other_order) if other_order else None,
            lowest_rpm=rpm_from,
            highest_rpm=rpm_to,
            rpm_step=rpm_step,
        )
        tracked, path = orders_into_campaign(campaign, time_run, options, name)
    for line in described_orders(time_run, tracked, path):
        typer.echo(line)
