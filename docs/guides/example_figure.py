"""A figure, as it would stand in the module of its subject in deboom.plot."""

from __future__ import annotations

from typing import TYPE_CHECKING

from numpy.typing import ArrayLike

from deboom.plot.style import canvas, finite

if TYPE_CHECKING:
    from matplotlib.axes import Axes


def level_over_factor(factor: ArrayLike, level: ArrayLike, *, ax: Axes | None = None) -> Axes:
    """Draw a level [dB(A)] over a common factor of all mounts [1], both of shape (n,).

    - raises InputError: arrays of different lengths or values that are not finite.
    """
    data = finite("level_over_factor", {"factor": factor, "level": level})
    with canvas(ax, 5.0, 3.0) as axes:
        axes.plot(data["factor"], data["level"])
        axes.set(xlabel="common factor [1]", ylabel="level [dB(A)]")
        return axes
