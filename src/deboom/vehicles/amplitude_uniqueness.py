"""Whether an amplitude-dependent motion has one solution: several starts, compared."""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from deboom.arrays import RealArray
from deboom.vehicles.amplitude_motion import AmplitudeMotion, solve_along_lines, solve_from

STARTS = (1e-6, 1e-5, 1e-4, 1e-3, 5e-3)
"""Amplitudes of all directions that lines start from [m]."""

TOLERANCE = 1e-10
"""Of the solutions that are compared [1]."""

SAME = 1e-6
"""Largest difference of the logarithms of an amplitude that counts as the same solution [1]."""


class SeveralSolutionsWarning(UserWarning):
    """The solution of an amplitude-dependent motion depends on where it starts."""


@dataclass(frozen=True, eq=False)
class StartComparison:
    """Solutions of the same lines from several starts.

    Parameters
    ----------
    load_case : str
        Whose lines.
    frequency : array, shape (n_frequency,)
        [Hz].
    starts : tuple of float
        Amplitudes of all directions at the start [m]; beside them stands the start from the line
        before.
    difference : array, shape (n, n_frequency)
        Largest difference of the logarithm of an amplitude between two of the solutions [1].
    solved : array of bool, shape (n, n_frequency)
        Whether every start came to rest.
    """

    load_case: str
    frequency: RealArray
    starts: tuple[float, ...]
    difference: RealArray
    solved: npt.NDArray[np.bool_]

    @property
    def unique(self) -> bool:
        """Whether all starts of all lines and designs ended at the same solution."""
        return bool(self.solved.all() and (self.difference <= SAME).all())

    @property
    def text(self) -> str:
        """What was found, in a sentence."""
        spread = f"{len(self.starts)} starts from {self.starts[0]:g} to {self.starts[-1]:g} m"
        place = f"load case {self.load_case}: {spread} and the start from the line before"
        if self.unique:
            return f"{place} give one solution, amplitudes within {self.difference.max():.0e}"
        where = (self.difference > SAME) | ~self.solved
        lines = self.frequency[where.any(axis=0)]
        return (
            f"{place} do not give one solution: {np.count_nonzero(where.any(axis=1))} of "
            f"{len(where)} designs differ by up to {self.difference.max():.2g} in the logarithm of "
            f"an amplitude, or do not come to rest, at {lines.size} lines from {lines[0]:g} to "
            f"{lines[-1]:g} Hz: results there belong to the branch of the line before"
        )


def compare_starts(
    motion: AmplitudeMotion, designs: RealArray, starts: Sequence[float] = STARTS
) -> StartComparison:
    """Solve designs (n, n_variable) from several amplitudes and compare what comes out.

    Parameters
    ----------
    motion : AmplitudeMotion
        Equations of motion of one load case.
    designs : array, shape (n, n_variable)
        Stiffness factors [1].
    starts : sequence of float
        Amplitudes of all directions at the start [m].

    Returns
    -------
    StartComparison

    Warns
    -----
    SeveralSolutionsWarning
        The starts end at different solutions, or some do not come to rest.
    """
    found = [solve_along_lines(motion, designs, TOLERANCE)]
    found += [solve_from(motion, designs, start, TOLERANCE) for start in starts]
    follows = motion.follows
    logarithms = np.log([one.ratio[..., follows] for one in found])
    comparison = StartComparison(
        load_case=motion.load_case,
        frequency=motion.frequency,
        starts=tuple(starts),
        difference=np.ptp(logarithms, axis=0).max(axis=-1, initial=0.0),
        solved=np.logical_and.reduce([one.solved for one in found]),
    )
    if not comparison.unique:
        warnings.warn(comparison.text, SeveralSolutionsWarning, stacklevel=2)
    return comparison
