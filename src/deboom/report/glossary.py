"""Definitions of the terms on pages, for readers who are new to the field."""

from __future__ import annotations

from collections.abc import Mapping

GLOSSARY: Mapping[str, str] = {
    "booming noise": (
        "The low drone in the cabin at full load and low engine speed. The engine's torque pulses "
        "(its firing order) shake the powertrain; the mounts pass forces on to the body, and body "
        "panels press on the air of the cabin."
    ),
    "SPL": (
        "Sound pressure level at the driver's ear in dB(A): decibels re 20 µPa, weighted by "
        "how well the ear hears each frequency. 3 dB less is half the sound energy."
    ),
    "SPLV": (
        "The booming index of one vehicle: the sum of its SPL over all frequency lines of the "
        "band. Divided by the number of lines it is the mean SPL, which is easier to read; the "
        "figures show that."
    ),
    "booming peak": (
        "A local maximum of the SPL curve that stands out by at least 6 dB (its prominence): the "
        "engine speed at which a passenger complains."
    ),
    "stiffness factor": (
        "The design variable. It scales the dynamic stiffness of one mount in one axis, over the "
        "whole curve of dynamic stiffness against static force; 1 is today's part, 0.8 is 20 % "
        "softer. The loss factor stays. It means the curve, with stops re-tuned, not merely a "
        "softer rubber in the same shape."
    ),
    "stiffness factor of a part": (
        "The design variable. It scales the rubber of one mount in one axis: its force at every "
        "deflection, statically and dynamically; 1 is today's part, 0.8 is 20 % softer. The stops "
        "stay where they are, so under the engine's torque the mount rides elsewhere on its curve."
    ),
    "dynamic stiffness": (
        "Force per displacement under vibration, here as its magnitude in N/mm at a stated "
        "frequency and load. It is not the static stiffness of a data sheet."
    ),
    "loss factor": (
        "The part of a mount's dynamic stiffness that takes energy out, over the part that gives "
        "it back: the tangent of the angle by which the force leads the displacement."
    ),
    "preload": (
        "The static force in one direction of a mount under the engine's torque, about which it "
        "vibrates. Rubber is stiffer the further it is loaded."
    ),
    "tolerance": (
        "Manufacturing scatter of a mount's stiffness around its own value, drawn at random many "
        "times for each design. Its half width counts as three standard deviations."
    ),
    "σ": (
        "Standard deviation over the tolerance: how far parts that are all within their drawing "
        "make nominally identical vehicles differ."
    ),
    "Pareto front": (
        "The designs that no other one beats in both objectives at once: whoever wants a lower "
        "mean level must accept more scatter, and the reverse. Each point is a complete set of "
        "mount stiffnesses."
    ),
    "no requirement": (
        "The stiffness of this mount in this axis has no influence on the result. It may keep its "
        "present value; nothing needs to be held for the sake of booming."
    ),
    "not identified": (
        "The measurement cannot tell the stiffness of this mount in this axis well enough to ask "
        "for a number: its 95 % interval is wider than ±15 %, or nothing was measured. Please "
        "leave it as it is."
    ),
    "no noticeable difference": (
        "The range of one stiffness, all others kept, within which the result does not change by "
        "more than its own uncertainty. Inside it the supplier is free."
    ),
    "noise transfer function": (
        "Sound pressure at the ear per force at one mount and axis of one vehicle, in Pa/N, "
        "measured on the vehicle without its engine."
    ),
    "blocked force": (
        "The force with which a source would push at a receiver that does not give way, in N, or "
        "the moment in N m. It belongs to the source alone, whatever it stands on."
    ),
    "virtual point": (
        "The place to which several sensors and hammer blows around it are referred, as if one "
        "could measure three translations and three rotations, and push with three forces and "
        "three moments, right there."
    ),
    "prescribed motion": (
        "The engine's motion at the mounts is taken as measured and kept while stiffnesses "
        "change. In high gears this tends to understate the effect of a change (on the virtual "
        "test bench by 20 to 25 % in gears 5 to 7)."
    ),
    "coupled motion": (
        "The engine's motion is solved again for every design: powertrain and wheel ends answer "
        "to the changed stiffnesses, which keep the values of the measured amplitudes."
    ),
    "amplitude-dependent motion": (
        "Coupled motion in which every mount's stiffness also follows the amplitude that comes "
        "out: rubber softens as it moves further."
    ),
    "hypervolume": (
        "How much of a box a front dominates, from its ideal corner to a stated reference point: "
        "one number for a whole front, the larger the better."
    ),
    "attainment band": (
        "From what the luckiest to what the unluckiest of several seeds attains; the line within "
        "is what half of them attain."
    ),
    "within noise": (
        "A difference that other draws and other seeds could have given as well. A real "
        "difference is larger than chance explains at 99 %."
    ),
    "not decided": (
        "Two fronts of fewer than three seeds each differ by less than their searches may still "
        "miss: three seeds of each would decide."
    ),
    "sensitivity index": (
        "The share of an output's variance that a variable is behind, between 0 and 1, when all "
        "variables vary at the same time within stated ranges (Sobol index). First order: what "
        "the variable does alone. Total: that and all it does together with others; the rest is "
        "the interaction. A variable whose total index is zero can be left out."
    ),
    "correlation": (
        "How far two vehicles rise and fall together when mounts change: 1 always in step, 0 not "
        "at all, −1 always opposed. Pearson's coefficient (r) takes the levels themselves, "
        "Spearman's only their order. It says nothing about how much each of them changes."
    ),
    "family of vehicles": (
        "Vehicles of which any two correlate at least as much as asked: a design that is better "
        "for one of them is better for the others, so that they can share one mount set."
    ),
}
"""Definition by term."""
