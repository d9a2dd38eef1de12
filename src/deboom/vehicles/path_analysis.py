"""Transfer path analysis at one ear, and the comparison of noise transfer functions."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from enum import Enum

import numpy as np
import pandas as pd

from deboom.arrays import ComplexArray, RealArray, checked
from deboom.errors import InputError
from deboom.measurement.channels import Frf, Spectrum, unit_of_response
from deboom.physics import sound_level, transfer_path
from deboom.physics.frf import corr_f, corr_s
from deboom.physics.sound_level import spl
from deboom.tabled import Tabled
from deboom.vehicles.fleet import Band, lines_inside, refuse_doubled


class Measure(Enum):
    """By what paths are ranked.

    `ENERGY_SHARE` is the part of the energy of the sum, with its phase: it adds up to 1 and is
    below 0 for a path that takes away. `MAGNITUDE` is the rms of ``|contribution|`` [Pa, peak]:
    large also for paths that cancel each other.
    """

    ENERGY_SHARE = "energy share"
    MAGNITUDE = "rms contribution"


@dataclass(frozen=True)
class RankedPath:
    """One path in a ranking.

    - `path`: name of the path.
    - `energy_share`: share of the energy of the sum, signed [1].
    - `magnitude`: rms of its contribution over the lines, peak amplitude [Pa].
    """

    path: str
    energy_share: float
    magnitude: float


@dataclass(frozen=True)
class Ranking:
    """Paths in order of what they bring, and what the order means.

    - `measure`: what the order goes by; falling.
    - `band` (lower, upper): lines that count, edges included [Hz].
    - `a_weighted`: whether lines count as loud as they are heard.
    - `paths`: all paths.
    """

    measure: Measure
    band: Band
    a_weighted: bool
    paths: tuple[RankedPath, ...]


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
        """Paths by their share of the A-weighted energy over all lines, largest first."""
        ranked = self.ranking().paths
        return pd.DataFrame(
            {
                "path": [path.path for path in ranked],
                "share of the energy [%]": [100 * path.energy_share for path in ranked],
                "rms contribution [Pa]": [path.magnitude for path in ranked],
            }
        )

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

    def ranking(
        self,
        measure: Measure = Measure.ENERGY_SHARE,
        band: Band | None = None,
        *,
        a_weighted: bool = True,
    ) -> Ranking:
        """Order the paths by what they bring.

        - `measure`: what the order goes by.
        - `band` (lower, upper), optional, optional: lines that count, edges included; by default
          all [Hz].
        - `a_weighted`: weight the energy of the lines as it is heard. Without it the lowest lines
          rule.
        - raises InputError: a band without lines, or paths that add up to nothing.
        """
        band = band or (float(self.frequency[0]), float(self.frequency[-1]))
        inside = lines_inside(self.frequency, band, f"path analysis of {self.ear}")
        lines, values = self.frequency[inside], self.contributions[inside]
        # 10^(A/10) is the energy weight, 10^(A/20) would be that of the amplitude
        weight = 10 ** (sound_level.a_weighting(lines) / 10) if a_weighted else np.ones(lines.size)
        entries = [
            RankedPath(path, float(share), float(size))
            for path, share, size in zip(
                self.paths,
                transfer_path.energy_share(values, weight),
                transfer_path.rms_contribution(values, weight),
                strict=True,
            )
        ]
        by_share = measure is Measure.ENERGY_SHARE
        entries.sort(
            key=lambda path: path.energy_share if by_share else path.magnitude, reverse=True
        )
        return Ranking(measure, band, a_weighted, tuple(entries))


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


@checked(
    frequency="f",
    corr_f="p",
    corr_s="p",
    level_difference="f p ?",
    contributions="2 f p",
    spl="2 f ?",
)
class TransferComparison:
    """Noise transfer functions acquired twice, such as with loudspeaker and hammer.

    - `frequency` (n_frequency,) [Hz].
    - `paths`: ``<mount> <axis>``.
    - `corr_f`, `corr_s` (n_path,): difference in shape and in scale of the complex functions of
      each path [1].
    - `level_difference` (n_frequency, n_path): second over first, of the functions [dB].
    - `contributions` (2, n_frequency, n_path): pressure through each path with either set [Pa].
    - `spl` (2, n_frequency): level of the sum over the paths with either set [dB(A)].
    """

    frequency: RealArray
    paths: tuple[str, ...]
    corr_f: RealArray
    corr_s: RealArray
    level_difference: RealArray
    contributions: ComplexArray
    spl: RealArray

    @property
    def pressure(self) -> ComplexArray:
        """Sum over the paths with either set, shape (2, n_frequency) [Pa]."""
        return np.asarray(self.contributions.sum(axis=2))

    @property
    def spl_difference(self) -> RealArray:
        """Second minus first, shape (n_frequency,) [dB]."""
        return np.asarray(self.spl[1] - self.spl[0])


def compare_noise_transfer(first: Frf, second: Frf, force: Spectrum) -> TransferComparison:
    """Compare two acquisitions at one ear, and the sound they give with the same forces.

    - `first`, `second`: one output, the same in both; inputs hold every channel of `force` [Pa/N].
    - `force`: force of each path [N].
    - raises InputError: more than one ear, or different ones; a path without noise transfer
      function; lines that differ.

    Thesis, section 3.7.1 and figures 41 and 42: the same forces, one vehicle, two methods.
    """
    if len(first.outputs) != 1 or first.outputs != second.outputs:
        raise InputError(
            f"noise transfer functions of different microphones cannot be compared: "
            f"{list(first.outputs)} and {list(second.outputs)}; select() the same ear of both"
        )
    for frf, which in ((first, "first"), (second, "second")):
        missing = [path for path in force.channels if path not in frf.inputs]
        if missing:
            raise InputError(
                f"the {which} set has no noise transfer function of {missing}, there are "
                f"{list(frf.inputs)}: measure these paths, or leave their forces out"
            )
        if not np.array_equal(frf.frequency, force.frequency):
            raise InputError(f"the {which} set and the forces have different frequency lines")
    pair = [frf.select(inputs=force.channels).values[:, 0, :] for frf in (first, second)]
    through = np.array([transfer_path.contributions(ntf, force.values) for ntf in pair])
    return TransferComparison(
        frequency=force.frequency,
        paths=force.channels,
        corr_f=corr_f(pair[1], pair[0]),
        corr_s=corr_s(pair[1], pair[0]),
        level_difference=20 * np.log10(np.abs(pair[1]) / np.abs(pair[0])),
        contributions=through,
        spl=np.array([spl(pressure, force.frequency) for pressure in through.sum(axis=2)]),
    )
