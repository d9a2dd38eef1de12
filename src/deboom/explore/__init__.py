"""Designs in, responses out: robustness, optimisation, selection.

Depends on: numpy and pandas only; it never sees physics.
"""
