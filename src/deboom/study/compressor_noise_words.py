"""Captions of the page on the sound of a running compressor."""

from __future__ import annotations

from collections.abc import Mapping

CAPTIONS: Mapping[str, str] = {
    "figure_65_soft_hoses": "Level at the driver's ear with long soft hoses, which cut the paths "
    "of the hoses (thesis, figure 65): synthesised from mounts and noise transfer functions "
    "against measured. Shade: where 90 % of what the measurements allow lies.",
    "figure_66_standard_hoses": "Level with the car's own hoses (thesis, figure 66). Mounts alone "
    "miss the measurement where hoses carry sound; with the identified hoses the synthesis "
    "follows. The motion is that of the sweep with hoses in both.",
    "contributions": "Level of each mount and hose on its own, forces and moments summed with "
    "their phases. Where a single one is louder than all together, others cancel it.",
    "body_motion": "What it changes to take the body under the mounts as standing still, or to "
    "predict its motion by accelerances instead of measuring it. A sum of paths that cancel each "
    "other is changed most.",
    "all_cars": "All cars and laboratories. Left: each peak with soft hoses. Middle and right: 90 "
    "of 100 lines of a sweep with standard hoses deviate by less, with and without modelled hoses.",
    "hose_gain": "How much louder the car's hoses make the compressor, line by line, in cars drawn "
    "from the prior of the fleet; nothing selected, nothing tuned. Dotted: what the thesis "
    "observed on its one car between 90 and 140 Hz.",
}
