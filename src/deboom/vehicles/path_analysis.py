"""Transfer path analysis at one ear."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
import pandas as pd

from deboom.arrays import ComplexArray, RealArray, checked
from deboom.errors import InputError
from deboom.measurement.channels import Frf, Spectrum, unit_of_response
from deboom.physics import sound_level, transfer_path
from deboom.tabled import Tabled
from deboom.vehicles.fleet import Band, lines_inside, refuse_doubled


@checked(frequency="f", contributions="f p")
class PathAnalysis(Tabled):
    """Complex contributions of all paths to the pressure at one ear.

    - `ear`: name of the microphone.
    - `frequency` (n_frequency,) [Hz].
    - `contributions` (n_frequency, n_path): complex peak [Pa].
    - `paths`: names of the columns: paths, sources of airborne noise, or groups of them.
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


def analyse_paths(
    noise_transfer: Frf,
    force: Spectrum,
    acoustic_transfer: Frf | None = None,
    source_strength: Spectrum | None = None,
) -> PathAnalysis:
    """Split the pressure at one ear into the contributions of its paths.

    Parameters
    ----------
    noise_transfer : Frf
        One output, the ear; one input per path, in any order [Pa/N].
    force : Spectrum
        One channel per path [N]; `measurement.path_forces` says in which state of the receiver the
        transfer functions belong with them.
    acoustic_transfer : Frf, optional
        The same ear per strength of each airborne source, such as Pa/(m^3/s); by default none.
    source_strength : Spectrum, optional
        Strength of each source, such as its volume velocity [m^3/s].

    Returns
    -------
    PathAnalysis
        Paths in the order of the forces, then the airborne sources.

    Raises
    ------
    InputError
        Not exactly one ear or two different ones, a path without noise transfer function or without
        force, names in both kinds of path, lines or units that differ, one airborne argument
        without the other.

    Notes
    -----
    ``p_d = Σ_j Y_dj f_j + Σ_k Y_dk q_k``, thesis, eq. 12; the second sum is zero by default, as
    structure-borne noise is 90 to 95 % of the total at low frequency (eq. 13).

    Examples
    --------
    >>> import deboom
    >>> lines, paths = [30.0, 31.0], ("left z", "right z")
    >>> transfer = deboom.Frf(lines, [[[1.0, 2.0]]] * 2, ("driver ear",), paths, "Pa/N")
    >>> force = deboom.Spectrum(lines, [[0.1, 0.2j]] * 2, paths, "N")
    >>> deboom.analyse_paths(transfer, force).table["path"].tolist()
    ['right z', 'left z']
    """
    structure = _contributions(noise_transfer, force, "noise transfer function")
    ear = noise_transfer.outputs[0]
    if acoustic_transfer is None and source_strength is None:
        return PathAnalysis(ear, force.frequency, structure, force.channels)
    if acoustic_transfer is None or source_strength is None:
        raise InputError(
            "airborne noise needs both the acoustic transfer functions and the strength of the "
            "sources: give both, or none"
        )
    air = _contributions(acoustic_transfer, source_strength, "acoustic transfer function")
    if acoustic_transfer.outputs != noise_transfer.outputs:
        raise InputError(
            f"the noise transfer functions lead to {ear}, the acoustic ones to "
            f"{acoustic_transfer.outputs[0]}: give those of one microphone"
        )
    if not np.array_equal(force.frequency, source_strength.frequency):
        raise InputError("forces and airborne sources have different frequency lines")
    names = (*force.channels, *source_strength.channels)
    refuse_doubled(names, "path")
    return PathAnalysis(ear, force.frequency, np.hstack([structure, air]), names)


def paths_by_axis(paths: Sequence[str]) -> dict[str, tuple[str, ...]]:
    """Group paths ``<mount> [<piece>] <axis>`` by their axis, in the order they appear."""
    groups: dict[str, tuple[str, ...]] = {}
    for path in paths:
        axis = path.split()[-1]
        groups[axis] = (*groups.get(axis, ()), path)
    return groups


def _contributions(transfer: Frf, source: Spectrum, what: str) -> ComplexArray:
    """Multiply transfer functions to one ear with what goes in, path by path."""
    if len(transfer.outputs) != 1:
        raise InputError(
            f"{what}s of the microphones {list(transfer.outputs)}: select() the one ear to analyse"
        )
    unit = unit_of_response(transfer.unit, source.unit)
    if unit != "Pa":
        raise InputError(
            f"{what}s in {transfer.unit} times paths in {source.unit} are {unit}, not Pa: convert "
            "them first"
        )
    missing = [path for path in source.channels if path not in transfer.inputs]
    if missing:
        raise InputError(
            f"no {what} of the paths {missing}, there are {list(transfer.inputs)}: measure them, "
            "or select() the paths that have one"
        )
    surplus = [path for path in transfer.inputs if path not in source.channels]
    if surplus:
        raise InputError(
            f"the paths {surplus} have a {what} and nothing that goes in: select() the paths that "
            "count"
        )
    if not np.array_equal(transfer.frequency, source.frequency):
        raise InputError(
            f"the {what}s and what goes in have different frequency lines: bring both to the same "
            "lines, nothing is interpolated here"
        )
    same_order = transfer.select(inputs=source.channels)
    return transfer_path.contributions(same_order.values[:, 0, :], source.values)
