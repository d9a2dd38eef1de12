"""Transfer path analysis at one ear."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
import pandas as pd

from deboom.arrays import ComplexArray, RealArray, checked
from deboom.errors import InputError
from deboom.measurement.channels import Band, Frf, Spectrum, lines_inside, refuse_doubled
from deboom.physics import sound_level, transfer_path
from deboom.tabled import Tabled


@checked(frequency="f", contributions="f p")
class PathAnalysis(Tabled):
    """Complex contributions of all paths to the pressure at one ear.

    - `ear`: name of the microphone.
    - `frequency` (n_frequency,) [Hz].
    - `contributions` (n_frequency, n_path): complex peak [Pa].
    - `paths`: names of the columns: paths, or groups of them.

    See Also
    --------
    deboom.analyse_paths, deboom.BoomingModel
    """

    ear: str
    frequency: RealArray
    contributions: ComplexArray
    paths: tuple[str, ...]

    @property
    def pressure(self) -> ComplexArray:
        """Sum of all paths, complex peak, shape (n_frequency,) [Pa]."""
        return np.asarray(self.contributions.sum(axis=1))

    @property
    def level(self) -> RealArray:
        """Level of the sum, shape (n_frequency,) [dB(A)]."""
        return sound_level.spl(self.pressure, self.frequency)

    @property
    def path_levels(self) -> RealArray:
        """Level of each path on its own, shape (n_frequency, n_path) [dB(A)].

        They do not add up to `level`; a path without any contribution has −∞.
        """
        return sound_level.spl(self.contributions, self.frequency)

    @property
    def table(self) -> pd.DataFrame:
        """Paths by their own size over all lines, see `ranking`."""
        return self.ranking()

    def grouped(self, groups: Mapping[str, Sequence[str]]) -> PathAnalysis:
        """Return the partial sums of groups of paths, such as all paths along z.

        - `groups`: name of each group to its paths; every path in exactly one group.
        - raises InputError: a path in no group or in two, or one that does not exist.
        """
        named = [path for group in groups.values() for path in group]
        refuse_doubled(named, "path in the groups")
        unknown = [path for path in named if path not in self.paths]
        left_out = [path for path in self.paths if path not in named]
        if unknown or left_out:
            raise InputError(
                f"the groups leave out {left_out} and name {unknown}, which do not exist: name "
                f"each of {list(self.paths)} in one group"
            )
        columns = [[self.paths.index(path) for path in group] for group in groups.values()]
        sums = transfer_path.partial_sums(self.contributions, columns)
        return PathAnalysis(self.ear, self.frequency, sums, tuple(groups))

    def ranking(self, band: Band | None = None) -> pd.DataFrame:
        """Tabulate the paths by their own size, the largest first; lines count as they are heard.

        The rms contribution of a path is that of its peak amplitude. Its share of the energy of the
        sum counts the phase: shares add up to 100 %, below 0 a path takes away.

        - `band` (lower, upper), optional: lines that count, edges included; by default all [Hz].
        - raises InputError: a band without lines, or paths that add up to nothing.
        """
        band = band or (float(self.frequency[0]), float(self.frequency[-1]))
        inside = lines_inside(self.frequency, band, f"path analysis of {self.ear}")
        values = self.contributions[inside]
        # 10^(A/10) is the energy weight, 10^(A/20) would be that of the amplitude
        weight = 10 ** (sound_level.a_weighting(self.frequency[inside]) / 10)
        size = transfer_path.rms_contribution(values, weight)
        order = np.argsort(-size, kind="stable")
        return pd.DataFrame(
            {
                "path": np.array(self.paths)[order],
                "rms contribution [Pa]": size[order],
                "share of the energy [%]": 100 * transfer_path.energy_share(values, weight)[order],
            }
        )


def analyse_paths(noise_transfer: Frf, force: Spectrum) -> PathAnalysis:
    """Split the pressure at one ear into the contributions of its paths.

    Parameters
    ----------
    noise_transfer : Frf
        One output, the ear; one input per path, in any order [Pa/N].
    force : Spectrum
        One channel per path [N]; `measurement.path_forces` says in which state of the receiver the
        transfer functions belong with them.

    Returns
    -------
    PathAnalysis
        Paths in the order of the forces.

    Raises
    ------
    InputError
        Not exactly one ear, a path without noise transfer function or without force, lines that
        differ, units that do not give Pa.

    See Also
    --------
    deboom.BoomingModel, deboom.vehicles.path_analysis.PathAnalysis
    deboom.forces_by_mount_stiffness

    Notes
    -----
    ``p_d = Σ_j Y_dj f_j``, thesis, eq. 13: structure-borne noise is 90 to 95 % of the total at low
    frequency; eq. 12 is `deboom.physics.transfer_path.pressure_with_airborne`.

    Examples
    --------
    >>> import deboom
    >>> lines, paths = [30.0, 31.0], ("left z", "right z")
    >>> transfer = deboom.Frf(lines, [[[1.0, 2.0]]] * 2, ("driver ear",), paths, "Pa/N")
    >>> force = deboom.Spectrum(lines, [[0.1, 0.2j]] * 2, paths, "N")
    >>> deboom.analyse_paths(transfer, force).table["path"].tolist()
    ['right z', 'left z']
    """
    if len(noise_transfer.outputs) != 1:
        raise InputError(
            f"noise transfer functions of the microphones {list(noise_transfer.outputs)}: select() "
            "the one ear to analyse"
        )
    missing = [path for path in force.channels if path not in noise_transfer.inputs]
    if missing:
        raise InputError(
            f"no noise transfer function of the paths {missing}, there are "
            f"{list(noise_transfer.inputs)}: measure them, or select() the paths that have one"
        )
    surplus = [path for path in noise_transfer.inputs if path not in force.channels]
    if surplus:
        raise InputError(
            f"the paths {surplus} have a noise transfer function and no force: select() the paths "
            "that count"
        )
    chosen = noise_transfer.select(inputs=force.channels)
    (unit,) = chosen.response_units(force.units)
    if unit != "Pa":
        raise InputError(
            f"noise transfer functions in {noise_transfer.unit} times forces in {force.unit} are "
            f"{unit}, not Pa: convert them first"
        )
    if not np.array_equal(noise_transfer.frequency, force.frequency):
        raise InputError(
            "the noise transfer functions and the forces have different frequency lines: bring "
            "both to the same lines, nothing is interpolated here"
        )
    transfer = chosen.values[:, 0, :]
    heard = transfer_path.contributions(transfer, force.values)
    return PathAnalysis(noise_transfer.outputs[0], force.frequency, heard, force.channels)


def paths_by_axis(paths: Sequence[str]) -> dict[str, tuple[str, ...]]:
    """Group paths ``<mount> [<piece>] <axis>`` by their axis, in the order they appear."""
    groups: dict[str, tuple[str, ...]] = {}
    for path in paths:
        axis = path.split()[-1]
        groups[axis] = (*groups.get(axis, ()), path)
    return groups
