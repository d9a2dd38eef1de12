"""Pressures of the gas as a user asks for them: ``7.5`` or ``7.5=2`` [bar]."""

from __future__ import annotations

from collections.abc import Sequence

from deboom.errors import InputError


def weighted_pressures(requests: Sequence[str] | None) -> dict[str, float]:
    """Read ``7.5`` or ``7.5=2``: pressures in bar with their weights.

    Raises
    ------
    InputError
        No number, a weight that is not above 0, a pressure twice.
    """
    chosen: dict[str, float] = {}
    for request in requests or ():
        text, _, weight = request.partition("=")
        try:
            name, share = f"{float(text):g} bar", float(weight or 1)
        except ValueError:
            name, share = "", 0.0
        if not 0 < share < float("inf") or name in chosen:
            raise InputError(
                f"--pressure {request}: write each pressure once, as BAR or BAR=WEIGHT with a "
                "weight above 0, such as 7.5=2"
            )
        chosen[name] = share
    return chosen


def weights_of(asked: dict[str, float], measured: Sequence[str]) -> dict[str, float]:
    """Return the weights of pressures that were measured; of all alike where none is asked for.

    Raises
    ------
    InputError
        A pressure that was not measured.
    """
    unknown = [name for name in asked if name not in measured]
    if unknown:
        raise InputError(f"no sweep at {unknown[0]} was measured, only at {', '.join(measured)}")
    return asked or dict.fromkeys(measured, 1.0)
