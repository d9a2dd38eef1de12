"""Definitions of the terms on pages, for readers who are new to the field."""

from __future__ import annotations

from collections.abc import Mapping

GLOSSARY: Mapping[str, str] = {
    "booming noise": (
        "The low drone in the cabin at full load and low engine speed. The torque pulses of the "
        "engine (its firing order) shake the powertrain. The mounts transmit forces to the body, "
        "and body panels make the air of the cabin vibrate."
    ),
    "SPL": (
        "Sound pressure level at the driver's ear in dB(A): decibels re 20 µPa, weighted by the "
        "sensitivity of the ear at each frequency. 3 dB less is half the sound energy."
    ),
    "SPLV": (
        "The booming index of one vehicle: the sum of its SPL over all frequency lines of the "
        "band. Figures show it divided by the number of lines: the mean SPL, which is easier to "
        "read."
    ),
    "booming peak": (
        "A local maximum of the SPL curve that stands out by at least 6 dB (its prominence): the "
        "engine speed at which a passenger complains."
    ),
    "stiffness factor": (
        "The design variable. It scales the dynamic stiffness of one mount in one axis, over the "
        "whole curve of dynamic stiffness against static force; 1 is today's part, 0.8 is 20 % "
        "softer. The loss factor stays. The stops are re-tuned with the curve; a softer rubber in "
        "the same shape is not meant."
    ),
    "stiffness factor of a part": (
        "The design variable. It scales the rubber of one mount in one axis: its force at every "
        "deflection, statically and dynamically; 1 is today's part, 0.8 is 20 % softer. The stops "
        "stay, so under the torque of the engine the mount has another position on its curve."
    ),
    "dynamic stiffness": (
        "Force per displacement under vibration, here as its magnitude in N/mm at a stated "
        "frequency and load. It is not the static stiffness of a data sheet."
    ),
    "loss factor": (
        "The part of a mount's dynamic stiffness that dissipates energy, over the part that "
        "stores it: the tangent of the angle by which the force leads the displacement."
    ),
    "preload": (
        "The static force in one direction of a mount under the torque of the engine; the mount "
        "vibrates about it. Rubber is stiffer at a higher static force."
    ),
    "tolerance": (
        "Manufacturing scatter of a mount's stiffness about its nominal value, drawn at random "
        "many times for each design. Its half width counts as three standard deviations."
    ),
    "σ": (
        "Standard deviation over the tolerance: the difference between nominally identical "
        "vehicles whose parts are all within the tolerance."
    ),
    "Pareto front": (
        "The designs for which no other design is better in both objectives: a lower mean level "
        "costs more scatter, and the reverse. Each point is a complete set of "
        "mount stiffnesses."
    ),
    "no requirement": (
        "The stiffness of this mount in this axis has no influence on the result. It may keep its "
        "present value; booming sets no demand on it."
    ),
    "not identified": (
        "The measured stiffness of this mount in this axis is too uncertain to demand a number: "
        "its 95 % interval is wider than ±15 %, or nothing was measured. Please keep today's "
        "stiffness."
    ),
    "no noticeable difference": (
        "The range of one stiffness, with all others unchanged, in which the result does not "
        "change by more than its uncertainty. Inside this range the supplier is free."
    ),
    "noise transfer function": (
        "Sound pressure at the ear per force at one mount and axis of one vehicle, in Pa/N, "
        "measured on the vehicle without its engine."
    ),
    "blocked force": (
        "The force in N, or the moment in N m, with which a source would push on a receiver that "
        "does not move. It belongs to the source and does not depend on the receiver."
    ),
    "virtual point": (
        "The point for which motion and load are computed from several sensors and hammer hits "
        "around it: three translations and three rotations, three forces and three moments."
    ),
    "prescribed motion": (
        "The motion of the engine at the mounts is taken as measured and does not change with the "
        "stiffnesses. In high gears this tends to understate the effect of a change (on the "
        "virtual test bench by 20 to 25 % in gears 5 to 7)."
    ),
    "coupled motion": (
        "The motion of the engine is solved again for every design: powertrain and wheel ends "
        "move differently with other stiffnesses. The stiffnesses keep their values at the "
        "measured amplitudes."
    ),
    "amplitude-dependent motion": (
        "Coupled motion in which the stiffness of every mount also depends on the computed "
        "amplitude: rubber softens with amplitude."
    ),
    "hypervolume": (
        "The volume that a front dominates, up to a stated reference point, as a share of a "
        "common box: one number for a whole front, the larger the better."
    ),
    "attainment band": (
        "The range from the best to the worst front of several seeds; the line inside is attained "
        "by half of the seeds."
    ),
    "within noise": (
        "A difference that other draws and other seeds can explain. A real difference is larger "
        "than chance explains at 99 %."
    ),
    "not decided": (
        "Two fronts differ by less than their searches can miss, and at least one of them has "
        "neither converged nor three seeds: three seeds of each would decide."
    ),
    "sensitivity index": (
        "The share of the variance of an output that comes from a variable, between 0 and 1, when "
        "all variables vary at the same time within stated ranges (Sobol index). First order: "
        "effect of the variable alone. Total: first order and all interactions with other "
        "variables. A variable with a total index of zero can be left out."
    ),
    "correlation": (
        "A measure of how alike the levels of two vehicles change with the mounts: 1 always "
        "together, 0 not at all, −1 always opposite. Pearson's coefficient (r) uses the levels, "
        "Spearman's only their order. It does not show how much each level changes."
    ),
    "family of vehicles": (
        "Vehicles of which any two correlate at least by a stated value: a design that is better "
        "for one of them is better for the others, so they can share one mount set."
    ),
}
"""Definition by term."""
