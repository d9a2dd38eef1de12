"""A figure, as it would stand in the module of its subject in deboom.plot."""

from deboom.plot.style import canvas, finite


def level_over_factor(factor, level, *, ax=None):
    """Draw a level [dB(A)] over a common factor of all mounts [1]."""
    data = finite("level_over_factor", {"factor": factor, "level": level})
    with canvas(ax, 5.0, 3.0) as axes:
        axes.plot(data["factor"], data["level"])
        axes.set(xlabel="common factor [1]", ylabel="level [dB(A)]")
        return axes
