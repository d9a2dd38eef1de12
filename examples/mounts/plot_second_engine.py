"""
Forces of a second engine
=========================

Do mounts that were characterised under one engine predict the measured forces of another one? The
second engine has another order, another motion and other sensors (thesis, 3.6.2). With two
measured campaigns, read their folders in place of the virtual ones.
"""

import tempfile
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd

import deboom
from deboom.bench.campaign import second_engine_plan, training_plan
from deboom.bench.powertrain import load_second_engine
from deboom.mounts.characterise import CharacteriseOptions, measuring_chains, training_runs
from deboom.mounts.measuring_chain import body_record
from deboom.mounts.operating_map import Preload, operating_maps
from deboom.mounts.surface_forces import predicted_forces

# %%
# Two virtual campaigns on the mount set M1, three cylinders first, then four.

folder = Path(tempfile.mkdtemp())
first = replace(training_plan("M1"), shaker_repeats=1, frequency=np.arange(20.0, 80.5, 3.0))
second = second_engine_plan("M1")
second = replace(second, runs=second.runs[2::3], frequency=np.arange(27.0, 80.5, 1.5))
deboom.bench.write_campaign(folder / "first", seed=1, plan=first)
deboom.bench.write_campaign(folder / "second", seed=501, plan=second, bench=load_second_engine())

# %%
# The mounts over the static force: it carries over to another engine, the wheel torque does not.

how = CharacteriseOptions(preload=Preload.STATIC_FORCE)
mounts = deboom.characterise(deboom.read_campaign(folder / "first"), "M1", how).mounts

# %%
# What the second engine measures: motion, force and static force of each direction, line by line.

campaign = deboom.read_campaign(folder / "second")
chains, runs = measuring_chains(campaign, how), training_runs(campaign, "M1", how)
records = [body_record(chain.alignment.body, runs, campaign.tolerances) for chain in chains]
maps = operating_maps(chains, records)

# %%
# Its forces, from its motion and the surfaces. Lines outside of the region in which a mount was
# measured are not predicted. The y stiffnesses are not identified and prove nothing.

forces = predicted_forces(mounts, maps, how.regressor)
columns = ("direction", "lines inside [%]", "rms error of F [%]")
rows = [(name, 100 * force.inside.mean(), 100 * force.error) for name, force in forces.items()]
pd.DataFrame(rows, columns=columns)

# %%
# The torque strut along its main axis, all runs.

strut = forces["TSM x"]
frequency = strut.lines.frequency[strut.inside]
clouds = {
    name: {"frequency [Hz]": frequency, "|F| of TSM x [N]": np.abs(force)}
    for name, force in (("measured", strut.measured), ("predicted", strut.force))
}
deboom.plot.joint_scatter(clouds, {"measured": "#0072B2", "predicted": "#D55E00"})
