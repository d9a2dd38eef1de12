"""The sheet of a compressor's mount: from a front over its axial and radial stiffness."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np
import pandas as pd
from scipy.stats import norm

from deboom.arrays import PERCENT, ComplexArray, RealArray
from deboom.compressor.cabin_index import GRAVITY, CabinIndex, MountStatics
from deboom.errors import InputError
from deboom.explore.choices import Pick
from deboom.explore.front import verification_response
from deboom.explore.robust import sigma_shares
from deboom.explore.sensitivity import (
    SensitivityInputs,
    SobolIndices,
    fast_sobol_indices,
    sobol_designs,
)
from deboom.files.acceptance import Programme, SheetDirection, SupplierSpecification
from deboom.files.front_run import ComparedRun, design_name
from deboom.pages.sensitivity import TENTH
from deboom.physics.dynamic_stiffness import N_PER_MM
from deboom.plot.style import mount_of
from deboom.supplier.numbers import IMPORTANCE, SURE
from deboom.supplier.sheet import NAN, DirectionFacts, PartSheet, SheetCurves, rounded
from deboom.supplier.sources import secrets_of_run

ALIKE = "mounts"
"""Name of the part where all mounts have one part number."""
SURE_HALF_WIDTH = float(norm.ppf(0.5 + SURE / 2.0))
"""Standard deviations of the half width of today's stiffness [1]."""
STEP = 1e-3
"""Relative step of the derivative of a level by a stiffness [1]."""


@dataclass(frozen=True, eq=False, kw_only=True)
class CompressorParts:
    """A front of a compressor's mounts, as far as their supplier needs it.

    Parameters
    ----------
    run : ComparedRun
        Finished, checked, with its model built again.
    pick : Pick or Path
        The design that is wanted, or a file that holds it.
    index : CabinIndex
        Levels of all cars.
    statics : MountStatics
        Travel under 1 g.
    reference_line : float
        Line at which dynamic stiffness is stated [Hz].
    amplitude : array, shape (m, 3)
        Peak amplitude of every mount at that line, axial and radial [m].
    deviation : callable
        1 σ of a mean of today's |K| over it [1], of the shares of the stiffnesses in it, (m, 3).
    programme : Programme
    since : SupplierSpecification or None
        Older sheet.
    """

    run: ComparedRun
    pick: Pick | Path
    index: CabinIndex
    statics: MountStatics
    reference_line: float
    amplitude: RealArray
    deviation: Callable[[RealArray], float]
    programme: Programme
    since: SupplierSpecification | None = None

    @cached_property
    def today(self) -> RealArray:
        """Today's design, shape (k,) [units of the space]."""
        return np.asarray(self.run.model.space.nominal)

    @cached_property
    def wanted(self) -> RealArray:
        """The picked design, shape (k,) [units of the space]."""
        return self.run.picked(self.pick)

    @cached_property
    def columns(self) -> dict[str, int]:
        """Chosen stiffnesses, such as ``mounts axial`` → column of a design."""
        space = self.run.model.space
        chosen = np.flatnonzero(space.upper > space.lower)
        return {space.names[column]: int(column) for column in chosen}

    @property
    def parts(self) -> tuple[str, ...]:
        """Names of the parts."""
        return tuple(dict.fromkeys(map(mount_of, self.columns)))

    def of(self, part: str | None) -> tuple[str, ...]:
        """Return the parts that are meant: one by its name, or all.

        Raises
        ------
        InputError
            No such part.
        """
        if part is not None and part not in self.parts:
            raise InputError(
                f"run {self.run.entry.folder} has no mount '{part}': use {', '.join(self.parts)}"
            )
        return self.parts if part is None else (part,)

    @cached_property
    def stiffness(self) -> ComplexArray:
        """Today's dynamic stiffness at the reference line, axial and radial of each mount [N/m]."""
        line = int(np.argmin(np.abs(self.index.frequency - self.reference_line)))
        return np.asarray(self.index.gain[line] * self.static)

    @cached_property
    def static(self) -> RealArray:
        """Today's static stiffness, shape (3 m,) [N/m]."""
        return np.array([mount.stiffness for mount in self.index.mounts]).ravel()

    def working_amplitude(self, column: int) -> float:
        """Return the mean amplitude at which a chosen stiffness works [m]."""
        return float(self.amplitude.ravel()[self.index.variables.scaled[column]].mean())

    def uncertainty(self, column: int) -> float:
        """Return the half width of today's |K| of a chosen stiffness over it, 95 % [1]."""
        weights = np.where(self.index.variables.scaled[column], abs(self.stiffness), 0.0)
        return SURE_HALF_WIDTH * self.deviation((weights / weights.sum()).reshape(-1, 3))

    def scattering(self, column: int) -> list[int]:
        """Return the columns that scatter together with a chosen one: batch and pieces."""
        scaled = self.index.variables.scaled
        inside = scaled.any(axis=1) & ~(scaled & ~scaled[column]).any(axis=1)
        return [int(each) for each in np.flatnonzero(inside)]

    def tolerance(self, column: int) -> float:
        """Return three standard deviations of a stiffness, of batch and piece together [1]."""
        scaled, space = self.index.variables.scaled, self.run.model.space
        first = int(np.flatnonzero(scaled[column])[0])
        together = [each for each in self.scattering(column) if scaled[each][first]]
        return float(np.sqrt(np.sum(space.tolerance[together] ** 2)))

    def mean_levels(self, designs: RealArray) -> RealArray:
        """Return the mean level over lines and cars, weighted as in the run, (n,) [dB(A)]."""
        return self.run.model.mean(self.index(designs)) / self.index.n_lines

    @cached_property
    def slope(self) -> dict[str, float]:
        """Change of the mean level per `TENTH` more of each stiffness of the wanted design [dB]."""
        slopes = {}
        for name, column in self.columns.items():
            both = np.tile(self.wanted, (2, 1))
            both[:, column] *= [1.0 - STEP, 1.0 + STEP]
            low, high = self.mean_levels(both)
            slopes[name] = float(TENTH * (high - low) / (2.0 * STEP))
        return slopes

    @cached_property
    def importance(self) -> SobolIndices:
        """Sobol indices of the mean level of all cars, within the bounds of the search."""
        space, seed = self.run.model.space, self.run.seed
        columns = list(self.columns.values())
        inputs = SensitivityInputs(tuple(self.columns), space.lower[columns], space.upper[columns])
        chosen = sobol_designs(inputs, IMPORTANCE, seed=seed)
        designs = np.tile(self.today, (len(chosen), 1))
        designs[:, columns] = chosen
        level = self.mean_levels(designs)[:, np.newaxis]
        return fast_sobol_indices(level, inputs.factors, ["mean level"], seed=seed)

    @cached_property
    def shares(self) -> dict[str, float]:
        """Share of each stiffness, batch and pieces, in the scatter of the wanted design [1]."""
        draws = self.run.entry.record["facts"]["verification_draws"]
        checked = verification_response(self.run.model, draws, seed=self.run.seed)
        shares = sigma_shares(checked, self.wanted).of_sum
        return {
            name: float(shares[self.scattering(column)].sum())
            for name, column in self.columns.items()
        }

    @cached_property
    def secrets(self) -> tuple[str, ...]:
        """What an anonymous sheet may not hold: names of cars, the study, and paths."""
        return secrets_of_run(self.run.entry, self.index.response_names)


@dataclass(frozen=True, eq=False, kw_only=True)
class CompressorSheet(PartSheet):
    """Sheet of one part number of a compressor's mounts.

    Parameters
    ----------
    parts : CompressorParts
    name : str
        Of the part.
    secrets, language, issued
        As of `PartSheet`.
    """

    parts: CompressorParts
    name: str

    @property
    def part(self) -> str:
        """Name of the part."""
        return self.name

    @property
    def title(self) -> str:
        """Head of the page."""
        german = "Kompressorlager" if self.part == ALIKE else f"Kompressorlager {self.part}"
        return self.language.say(
            f"Compressor {self.part}: dynamic stiffness for a quiet cabin",
            f"{german}: dynamische Steifigkeit für einen leisen Innenraum",
        )

    @property
    def description(self) -> str:
        """The part in words."""
        return self.language.say(
            "rubber mount between a refrigerant compressor and the body",
            "Gummilager zwischen Kältemittelverdichter und Karosserie",
        )

    @property
    def agreed(self) -> Programme:
        """The programme beside the car."""
        return self.parts.programme

    @property
    def since(self) -> SupplierSpecification | None:
        """Older sheet of this part."""
        return self.parts.since

    @property
    def directions(self) -> dict[str, int]:
        """Names of the directions of this part, and their columns."""
        return {n: c for n, c in self.parts.columns.items() if mount_of(n) == self.part}

    @property
    def pieces(self) -> int:
        """Mounts of this part number under a compressor."""
        column = next(iter(self.directions.values()))
        places = np.flatnonzero(self.parts.index.variables.scaled[column])
        return len({int(place) // 3 for place in places})

    @cached_property
    def specification(self) -> SupplierSpecification:
        """What is demanded, in the form that is read back; nothing of it is a must."""
        demands = []
        for name, column in self.directions.items():
            of_part = self.parts.index.variables.scaled[column]
            today = complex(self.parts.stiffness[of_part].mean())
            middle, half = float(self.parts.wanted[column]), self.parts.tolerance(column)
            rate = float(self.parts.static[of_part].mean()) * middle
            demands.append(
                SheetDirection(
                    name=name,
                    duty="preferred",
                    lower=middle * (1.0 - half),
                    upper=middle * (1.0 + half),
                    today_n_per_mm=abs(today) * N_PER_MM,
                    loss_factor=rounded(today.imag / today.real if today.imag > 0.0 else NAN, 4),
                    preload_n=None,
                    preload_mm=None,
                    amplitude_mm=rounded(1e3 * self.parts.working_amplitude(column), 4),
                    frequency_hz=self.parts.reference_line,
                    static_rate_n_per_mm=rounded(N_PER_MM * rate, 1),
                )
            )
        return self.specified(demands)

    @property
    def facts(self) -> tuple[DirectionFacts, ...]:
        """How sure today's stiffness is."""
        return tuple(
            DirectionFacts(self.parts.uncertainty(column)) for column in self.directions.values()
        )

    @property
    def acoustic_cpk(self) -> float | None:
        """No share of the pieces is stated."""
        return None

    @property
    def classes(self) -> str:
        """What the class of the directions means."""
        return self.language.say(
            "Preferred: asked for, no limit depends on it.",
            "Bevorzugt: gewünscht, kein Grenzwert hängt davon ab.",
        )

    @property
    def rests_on(self) -> str:
        """What the bands rest on, in one line."""
        half = PERCENT * max(self.parts.tolerance(column) for column in self.directions.values())
        return self.language.say(
            f"± {half:.0f} % about the wanted design, three standard deviations of batch and piece "
            "together",
            f"± {half:.0f} % um den gewünschten Entwurf, drei Standardabweichungen von Charge und "
            "Stück zusammen",
        )

    @property
    def notes(self) -> tuple[str, ...]:
        """Say what the data block holds for."""
        softest = np.array(self.parts.wanted)
        for column in self.parts.columns.values():
            softest[column] *= 1.0 - self.parts.tolerance(column)
        travel = (
            self.parts.statics.travel_ratio(each, self.parts.today)
            for each in (self.parts.wanted, softest)
        )
        at_nominal, at_ends = (f"{value:.2f}" for value in travel)
        say, line = self.language.say, f"{self.parts.reference_line:g}"
        pressure = self.parts.index.case_names[0]
        weight = f"{self.parts.statics.mass * GRAVITY:.0f}"
        return (
            say("The band rests on ", "Grundlage des Bandes: ") + self.rests_on + ".",
            say(
                "Axial is along the axis of the mount, radial across it, both radial directions "
                f"alike. N/mm hold at {line} Hz and the amplitude that a mount had there at "
                f"{pressure}, under the {weight} N of the compressor; how they load each axis is "
                "to be agreed. The ratio to today's part on one machine holds at any state. ± "
                "95 % of today's |K|: hammer test and drawing of the mounts.",
                "Axial ist längs der Lagerachse, radial quer dazu, beide radialen Richtungen "
                f"gleich. N/mm gelten bei {line} Hz und der Amplitude, die ein Lager dort bei "
                f"{pressure} hatte, unter den {weight} N des Kompressors; wie sie jede Achse "
                "belasten, ist noch zu vereinbaren. Das Verhältnis zum heutigen Teil auf einer "
                "Maschine gilt bei jedem Zustand. ± 95 % des heutigen |K|: Hammerversuch und "
                "Zeichnung der Lager.",
            ),
            say(
                f"Under 1 g a mount travels {at_nominal} times as far as today with the new part, "
                f"{at_ends} times at the lower ends of all bands: check the stops.",
                f"Unter 1 g bewegt sich ein Lager {at_nominal.replace('.', ',')}-mal so weit wie "
                f"heute mit dem neuen Teil, {at_ends.replace('.', ',')}-mal an den unteren Enden "
                "aller Bänder: Anschläge prüfen.",
            ),
        )

    @cached_property
    def worth(self) -> pd.DataFrame:
        """What stiffness and scatter of every direction are worth in the cabin."""
        important, names = self.parts.importance, list(self.parts.columns)
        rows = []
        for name in self.directions:
            place = names.index(name)
            rows.append(
                {
                    "direction": name,
                    "slope": self.parts.slope[name],
                    "first": PERCENT * max(float(important.first[place, 0]), 0.0),
                    "total": PERCENT * float(important.total[place, 0]),
                    "total_half_width": PERCENT * float(important.total_interval[place, 0]),
                    "sigma_part": PERCENT * self.parts.shares[name],
                }
            )
        return pd.DataFrame(rows)

    @cached_property
    def levels(self) -> pd.DataFrame:
        """Mean level of the cars today and at nominal; anonymous: changes."""
        designs = {"design today": self.parts.today}
        if len(self.parts.parts) > 1:
            alone = np.array(self.parts.today)
            columns = list(self.directions.values())
            alone[columns] = self.parts.wanted[columns]
            designs["design part"] = alone
        designs["design all"] = self.parts.wanted
        levels = self.parts.mean_levels(np.stack(list(designs.values())))
        table = pd.DataFrame(
            {
                "design": list(map(self.word, designs)),
                "level": levels,
                "change": [NAN, *(levels[1:] - levels[0])],
            }
        )
        return table.iloc[1:].drop(columns="level") if self.secrets else table

    @property
    def worth_words(self) -> str:
        """What both tables show."""
        return self.language.say(
            "Mean level of the compressor's first order at the driver's ear, mean over lines and "
            "cars, without scatter. Share of the variance of that level, where the stiffnesses "
            "vary within the bounds: by this one alone, and with others (Sobol indices); share of "
            "the scatter between cars as built. Errors of the measurements and of the model are "
            "not in these numbers: no expected change of a compressor's mounts was ever judged.",
            "Mittlerer Pegel der ersten Ordnung des Verdichters am Fahrerohr, Mittel über Linien "
            "und Fahrzeuge, ohne Streuung. Anteil an der Varianz dieses Pegels, wenn die "
            "Steifigkeiten in den Grenzen variieren: durch diese allein, und mit anderen "
            "(Sobol-Indizes); Anteil an der Streuung zwischen gebauten Fahrzeugen. Fehler der "
            "Messungen und des Modells sind in diesen Zahlen nicht enthalten: eine erwartete "
            "Änderung durch Verdichterlager wurde nie beurteilt.",
        )

    @property
    def over_frequency(self) -> pd.DataFrame:
        """No other frequency was measured."""
        return pd.DataFrame()

    @property
    def variants(self) -> pd.DataFrame:
        """No part numbers are shared."""
        return pd.DataFrame()

    @property
    def origin(self) -> dict[str, str]:
        """What the sheet follows from; an anonymous one names no run and no car."""
        say, parts, index = self.language.say, self.parts, self.parts.index
        low, high = index.frequency[0], index.frequency[-1]
        cases = zip(index.case_names, index.weights, strict=True)
        cars = index.response_names
        items = {
            say("lines", "Linien"): f"{low:g}–{high:g} Hz",
            say("pressures", "Drücke"): ", ".join(f"{n}; {weight:.2g}" for n, weight in cases),
            say("places x, y, z [mm]", "Orte x, y, z [mm]"): "; ".join(
                f"{mount.name} " + ", ".join(f"{1e3 * place:.1f}" for place in mount.position)
                for mount in index.mounts
            ),
            say("cars", "Fahrzeuge"): str(len(cars)) if self.secrets else ", ".join(cars),
        }
        if not self.secrets:
            items[say("run", "Lauf")] = parts.run.entry.name
            items[say("design", "Entwurf")] = design_name(parts.pick)
        return items

    @property
    def curves(self) -> SheetCurves:
        """The axes; no curve was measured."""
        axes: dict[str, Sequence[float]] = {
            "axial": (0.0, 0.0, 1.0),
            "radial": (1.0, 0.0, 0.0),
            self.language.say("radial, alike", "radial, gleich"): (0.0, 1.0, 0.0),
        }
        caption = self.language.say("Axes of the part.", "Achsen des Teils.")
        return SheetCurves(axes=axes, axes_caption=caption, along=axes["axial"])

    @property
    def glossary(self) -> tuple[str, ...]:
        """Words that a reader may not know."""
        return (
            self.language.say(
                "Static rate: wanted static stiffness. First order: sound at the frequency of the "
                "rotor.",
                "Statische Rate: gewünschte statische Steifigkeit. Erste Ordnung: Schall mit der "
                "Drehfrequenz des Rotors.",
            ),
        )
