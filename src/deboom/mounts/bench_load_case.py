"""One run on the test bench as a load case: motion and force at the virtual points."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from deboom.errors import InputError
from deboom.measurement.campaign import Campaign, OperatingRun
from deboom.measurement.channels import Spectrum
from deboom.measurement.load_case import LoadCase
from deboom.mounts.alignment_estimate import AlignmentEstimate
from deboom.mounts.body_record import body_record
from deboom.mounts.operating_map import operating_maps


def bench_load_case(
    campaign: Campaign, run: OperatingRun, chains: Sequence[AlignmentEstimate], title: str
) -> LoadCase:
    """Refer what the sensors of the bench recorded in one run to the virtual points.

    Parameters
    ----------
    campaign : Campaign
        That the run belongs to.
    run : OperatingRun
        Line by line; its lines keep their order.
    chains : sequence of AlignmentEstimate
        One per body, from `deboom.mounts.characterise.measuring_chains`.
    title : str
        What a reader calls the run.

    Returns
    -------
    LoadCase
        Motion relative to the bench, which stands still, and forces on it: blocked forces. Channels
        ``<mount> [<piece>] <axis>``.

    Raises
    ------
    InputError
        Channels of the chains that the run did not record, or a displacement of exactly 0.
    """
    records = [body_record(one.alignment.body, [run], campaign.tolerances) for one in chains]
    displacement, force = {}, {}
    for one in operating_maps(chains, records).values():
        for label in dict.fromkeys(one.run.tolist()):
            piece = label.removeprefix(run.name).strip()
            channel = " ".join(filter(None, (one.mount, piece, one.axis)))
            lines = one.select(one.run == label)
            if not np.array_equal(lines.frequency, run.frequency):
                raise InputError(f"run {run.name}: lines of {channel} are not those of the run")
            displacement[channel], force[channel] = lines.displacement, lines.force
    channels = tuple(force)
    moved, pushed = (np.column_stack([*one.values()]) for one in (displacement, force))
    return LoadCase(
        name=run.name,
        title=title,
        gear=run.gear,
        total_ratio=run.total_ratio,
        torque_limit=run.torque_limit,
        order=run.order,
        displacement=Spectrum(run.frequency, moved, channels, "m"),
        force=Spectrum(run.frequency, pushed, channels, "N"),
        engine_torque=run.engine_torque,
    )
