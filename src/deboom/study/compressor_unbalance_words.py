"""Captions of a running compressor's page."""

from __future__ import annotations

from collections.abc import Mapping

CAPTIONS: Mapping[str, str] = {
    "figure_52_motion": "Motion of the compressor over its speed (thesis, figure 52): first "
    "order, at the virtual point, the origin of the position sheet. Below: rms share of the "
    "channels that a rigid body cannot explain; it falls to the noise where the places that the "
    "hammer test found are used.",
    "figure_61a_static": "Static unbalance over speed (thesis, figure 61a), from the load in y "
    "and in z. A rotor makes both curves one horizontal line; a gas force that turns with it "
    "bends both alike at low speed. Shades: confidence bands. Hatched: not to be trusted, for the "
    "reason given.",
    "figure_61b_dynamic": "Dynamic unbalance about the virtual point (thesis, figure 61b), from "
    "the moments about z (y) and about y (z).",
    "figure_61c_forces": "Forces and moments inside (thesis, figure 61c). Unbalance grows with "
    "the square of the speed; the gas along and about x does not. Shades: confidence bands.",
    "figure_62_hoses": "Unbalance as it appears with the hoses of the vehicle against hoses cut "
    "off (thesis, figure 62). The difference is what the hoses push back.",
    "routes": "The routes side by side, first sweep. a: measured apparent mass times acceleration "
    "(thesis). b: model fitted at the virtual point. c: self-calibrated model. d: measured, with "
    "self-calibrated sensors and impacts. e: as c, mounts brought up to date by the sweep itself.",
    "mount_state": "Dynamic stiffness of the mounts in operation over that under the hammer, "
    "minus one, found from the sweeps; shades: two standard deviations. Away from 0 the hammer "
    "test no longer describes the mounts that run.",
    "changed_state": "The same compressor with mounts that changed between hammer and operation. "
    "Route a, as in the thesis's figure 61, goes wrong around the rigid-body modes; route e finds "
    "the change in the sweep and follows.",
    "errors": "Errors of static and dynamic unbalance, line by line, of every virtual compressor; "
    "the bar is the median.",
}
