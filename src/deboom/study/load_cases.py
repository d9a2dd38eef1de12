"""Load cases as a user asks for them: ``name`` or ``name=weight``."""

from __future__ import annotations

from collections.abc import Sequence

from deboom.errors import InputError
from deboom.files.platform import Platform
from deboom.measurement.load_case import LoadCase
from deboom.mounts.operating_stiffness import refuse_active_mounts


def weighted_load_cases(
    platform: Platform, requests: Sequence[str] | None
) -> list[tuple[LoadCase, float]]:
    """Look up load cases with their weights.

    Parameters
    ----------
    platform : Platform
        Where the load cases are.
    requests : sequence of str or None
        ``name`` (weight 1) or ``name=weight``; None or empty takes the platform's default.

    Returns
    -------
    list of (LoadCase, float)
        In the order asked for; weights not yet normalised [1].

    Raises
    ------
    InputError
        An unknown or repeated name, a weight that is no number above 0, or a load case in which
        a mount has a negative stiffness or a negative loss.
    """
    chosen: dict[str, float] = {}
    for request in requests or [platform.default_load_case]:
        name, has_weight, text = request.partition("=")
        try:
            weight = float(text) if has_weight else 1.0
        except ValueError:
            weight = -1.0
        if not 0.0 < weight < float("inf"):
            raise InputError(f"load case '{request}': write name=weight with a weight above 0")
        if name in chosen:
            raise InputError(f"load case '{name}' is asked for twice: give it one weight")
        chosen[name] = weight
    cases = [(platform.load_case(name), weight) for name, weight in chosen.items()]
    for case, _ in cases:
        refuse_active_mounts(case)
    return cases
