"""Designs of a front that a supplier may be asked for."""

from __future__ import annotations

from enum import Enum


class Pick(Enum):
    """Design of the front that the supplier is to build."""

    best_mean = "best-mean"
    best_sigma = "best-sigma"
    knee = "knee"
