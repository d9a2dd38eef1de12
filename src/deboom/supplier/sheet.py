"""What a mount supplier quotes and signs: the numbers of a sheet, as tables of its workbook."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import pandas as pd
from scipy.stats import norm

from deboom.choices import Language
from deboom.common import CONFIDENCE
from deboom.errors import InputError
from deboom.files.acceptance import (
    DATA_SHEET,
    FILL_IN,
    MEASURED,
    STIFFNESS,
    SheetDirection,
    SupplierSpecification,
    box_document,
)
from deboom.files.front_run import Direction, SupplierStudy, design_name
from deboom.mounts.mount import Mount
from deboom.supplier.numbers import ALL, PICKED, MachineState, SupplierEffects, machine_states
from deboom.supplier.sources import SheetSources, bands
from deboom.vehicles.free_directions import Need

ABOVE = 1.25
"""A process is taken to run at this multiple of the usual Cpk when that one is to be proven [1]."""
PERCENT, N_PER_MM, MILLI, MM = 100.0, 1e-3, 1e3, 1e3
NAN = float("nan")
MOVED = 0.005
"""Relative change from which a number of an older sheet counts as moved [1]."""


def asked_capability(share: float, n_axes: int) -> float:
    """Return the Cpk per axis with which a share of the pieces lies inside in all axes [1].

    Parameters
    ----------
    share : float
        Between 0 and 1 [1].
    n_axes : int
        Limited axes of a part.

    Notes
    -----
    ``2Φ(3 Cpk) − 1 ≥ share^(1/n)``: of a normal process with this Cpk at least so much lies inside,
    and independent axes are the worst case of correlated ones (Šidák, J. Am. Stat.
    Assoc. 62 (1967) 626).
    """
    return float(norm.ppf(0.5 * (1.0 + share ** (1.0 / n_axes))) / 3.0)


def measured_capability(asked: float, n_parts: int, confidence: float) -> float:
    """Return the Cpk that a sample must show so that its lower bound is the asked one [1].

    Parameters
    ----------
    asked : float
        [1].
    n_parts : int
        Measured, more than 2.
    confidence : float
        Of the one-sided bound [1].

    Notes
    -----
    The bound of `deboom.explore.scatter.capability`, solved for the sample's value.
    """
    z = float(norm.ppf(confidence))
    a = 1.0 - z**2 / (2.0 * (n_parts - 1))
    c = asked**2 - z**2 / (9.0 * n_parts)
    return float((asked + np.sqrt(asked**2 - a * c)) / a)


def proving_parts(asked: float, shown: float, confidence: float) -> int:
    """Return how many parts that show a Cpk prove a lower one [1]."""
    n_parts = np.arange(4, 1_000_000)
    z = float(norm.ppf(confidence))
    bound = shown - z * np.sqrt(1.0 / (9.0 * n_parts) + shown**2 / (2.0 * (n_parts - 1)))
    return int(n_parts[np.argmax(bound >= asked)])


@dataclass(frozen=True, eq=False)
class MountSheet:
    """All numbers of one mount's sheet.

    Parameters
    ----------
    study : SupplierStudy
    sources : SheetSources
    effects : SupplierEffects
        Of all mounts, about the middle of all bands.
    mount : Mount
    secrets : tuple of str
        Names and paths that an anonymous sheet may not hold; empty if it is not anonymous.
    language : Language
    """

    study: SupplierStudy
    sources: SheetSources
    effects: SupplierEffects
    mount: Mount
    secrets: tuple[str, ...]
    language: Language

    def say(self, english: str, german: str) -> str:
        """Choose the words of the sheet's language."""
        return german if self.language is Language.de else english

    def percent(self, share: float) -> str:
        """Write a share [1] in per cent, with the decimal sign of the language."""
        text = f"{PERCENT * share:.4g} %"
        return self.say(text, text.replace(".", ","))

    @cached_property
    def directions(self) -> tuple[Direction, ...]:
        """Directions of the mount."""
        return self.study.of(self.mount.name)

    @cached_property
    def bands(self) -> dict[str, tuple[float, float] | None]:
        """Their bands, see `bands`."""
        return bands(self.study, self.sources)

    @cached_property
    def states(self) -> dict[str, MachineState]:
        """States that their parts are tested at."""
        middle = {d.name: float(self.effects.middle[d.column]) for d in self.directions}
        return machine_states(self.study, self.directions, self.sources.programme, middle)

    @cached_property
    def specification(self) -> SupplierSpecification:
        """What is asked, in the form that is read back."""
        box, known = self.sources.box, self.sources.programme.mount(self.mount.name)
        return SupplierSpecification(
            mount=self.mount.name,
            revision=known.revision or "",
            language=self.language.value,
            box_sha256="" if box is None else str(box_document(box)["sha256"]),
            share_stated=None if box is None else box.share_stated,
            uncertainty=self.sources.programme.test.uncertainty,
            directions=tuple(map(self._asked, self.directions)),
        )

    def ends(self, direction: Direction) -> str:
        """Name the ends of the band that a limit sets."""
        box = self.sources.box
        return "" if box is None else box.variable(direction.name).set_by_limit

    def _asked(self, direction: Direction) -> SheetDirection:
        band, state = self.bands[direction.name], self.states.get(direction.name)
        free = direction.need is Need.nothing
        if direction.need is Need.anything:  # a box may have been searched further
            low, high = self.study.freedom.searched[direction.column]
            free = band is None or (low <= band[0] and band[1] <= high)
        duty = "must" if self.ends(direction) else "free" if free else "preferred"
        if direction.need is Need.unknown and duty != "must":
            duty = "not identified"
        today = None
        if state is not None and direction.need is not Need.unknown and band is not None:
            today = abs(state.stiffness) * N_PER_MM
        factor = float(self.effects.middle[direction.column])
        loss = NAN
        if state is not None and today is not None:
            changed = direction.loss_column
            loss = state.stiffness.imag / state.stiffness.real
            loss *= 1.0 if changed is None else float(self.study.wanted[changed])
        state = state if band is not None else None
        return SheetDirection(
            name=direction.name,
            duty=duty,  # type: ignore[arg-type]
            lower=None if band is None else band[0],
            upper=None if band is None else band[1],
            today_n_per_mm=today,
            loss_factor=_known(loss if loss > 0.0 else NAN, 4),
            preload_n=_known(state.preload if state else NAN, 0),
            preload_mm=_known(MM * state.deflection if state else NAN, 2),
            amplitude_mm=_known(MM * state.amplitude if state else NAN, 4),
            frequency_hz=_known(state.frequency if state else NAN, 2),
            static_rate_n_per_mm=_known(
                N_PER_MM * factor * state.static_rate if state and today else NAN, 1
            ),
        )

    def _fields(self, asked: SheetDirection) -> dict[str, str | float]:
        """Columns of a row of the data block that the page shows."""
        say, today = self.say, _nan(asked.today_n_per_mm)
        low, high = _nan(asked.lower), _nan(asked.upper)
        return {
            say("direction", "Richtung"): asked.name,
            say("class", "Klasse"): self.duty(asked),
            say("nominal |K| [N/mm]", "Nennwert |K| [N/mm]"): 0.5 * (low + high) * today,
            say("accepted from [N/mm]", "zulässig von [N/mm]"): low * today,
            say("accepted to [N/mm]", "zulässig bis [N/mm]"): high * today,
            "± [%]": PERCENT * (high - low) / (high + low),
            say("loss factor [1]", "Verlustfaktor [1]"): _nan(asked.loss_factor),
            **self._state(asked),
            say("static rate [N/mm]", "statische Rate [N/mm]"): _nan(asked.static_rate_n_per_mm),
        }

    def _state(self, asked: SheetDirection) -> dict[str, float]:
        """Columns of the state that a row holds at."""
        say = self.say
        return {
            say("preload [N]", "Vorlast [N]"): _nan(asked.preload_n),
            say("preload [mm]", "Vorlast [mm]"): _nan(asked.preload_mm),
            say("amplitude, peak [mm]", "Amplitude, Spitze [mm]"): _nan(asked.amplitude_mm),
            say("frequency [Hz]", "Frequenz [Hz]"): _nan(asked.frequency_hz),
        }

    @cached_property
    def block(self) -> pd.DataFrame:
        """Data block: one row per direction."""
        say, rows, programme = self.say, [], self.sources.programme
        stiffness = self.effects.certainty["stiffness"]
        saving = programme.mount(self.mount.name).saving or {}
        ends = {
            "": "–",
            "from": say("lower end", "unteres Ende"),
            "to": say("upper end", "oberes Ende"),
            "from and to": say("both ends", "beide Enden"),
        }
        for direction, asked in zip(self.directions, self.specification.directions, strict=True):
            place = self.study.directions.index(direction)
            state, half = self.states.get(direction.name), NAN
            if state is not None and direction.need is not Need.unknown:
                half = float(stiffness.half_width[place] / stiffness.value[place])
                half += state.other_axes
            saved = saving.get(direction.axis, NAN) if asked.duty == "free" else NAN
            rows.append(
                {
                    **self._fields(asked),
                    say("today |K| [N/mm]", "heute |K| [N/mm]"): _nan(asked.today_n_per_mm),
                    say("today ± 95 % [%]", "heute ± 95 % [%]"): PERCENT * half,
                    say("from, of today's [%]", "von, des heutigen [%]"): (
                        PERCENT * _nan(asked.lower)
                    ),
                    say("to, of today's [%]", "bis, des heutigen [%]"): PERCENT * _nan(asked.upper),
                    say("set by the noise limit", "durch Geräuschgrenzwert"): ends[
                        self.ends(direction)
                    ],
                    say("saving", "Ersparnis") + f" [{programme.currency}]": saved,
                }
            )
        return pd.DataFrame(rows)

    def duty(self, asked: SheetDirection) -> str:
        """Name the class of a direction."""
        german = {
            "must": "Muss",
            "preferred": "bevorzugt",
            "free": "frei",
            "not identified": "nicht identifiziert",
        }
        return self.say(asked.duty, german[asked.duty])

    @cached_property
    def tested(self) -> list[SheetDirection]:
        """Directions with a line of the test: each must, or what is preferred if there is none."""
        musts = list(self.specification.musts.values())
        return musts or [d for d in self.specification.directions if d.duty == "preferred"]

    @cached_property
    def test(self) -> pd.DataFrame:
        """One row per line of the test: state, specification limits, guarded limits."""
        say, guard, rows = self.say, self.specification.uncertainty, []
        for asked in self.tested:
            today, low, high = map(_nan, (asked.today_n_per_mm, asked.lower, asked.upper))
            nominal, loss = 0.5 * (low + high) * today, _nan(asked.loss_factor)
            size = np.sqrt(1.0 + loss**2)
            tight = (low / (1.0 - guard), high / (1.0 + guard)) if guard else (NAN, NAN)
            undecidable = guard is not None and tight[0] > tight[1]
            rows.append(
                {
                    say("direction", "Richtung"): asked.name,
                    **self._state(asked),
                    say("accepted |K| from [N/mm]", "zulässig |K| von [N/mm]"): low * today,
                    say("accepted |K| to [N/mm]", "zulässig |K| bis [N/mm]"): high * today,
                    say("guarded from [N/mm]", "eingeengt von [N/mm]"): tight[0] * today,
                    say("guarded to [N/mm]", "eingeengt bis [N/mm]"): tight[1] * today,
                    say("nominal K' [N/mm]", "Nennwert K' [N/mm]"): nominal / size,
                    say("nominal K'' [N/mm]", "Nennwert K'' [N/mm]"): nominal * loss / size,
                    say("loss angle [°]", "Verlustwinkel [°]"): np.degrees(np.arctan(loss)),
                    say("decides", "entscheidet"): (
                        say("no: this test cannot decide", "nein: diese Prüfung kann es nicht")
                        if undecidable
                        else say("yes", "ja")
                        if np.isfinite(today)
                        else say("as a ratio to today's part", "als Verhältnis zum heutigen Teil")
                    ),
                }
            )
        return pd.DataFrame(rows)

    @cached_property
    def to_fill_in(self) -> pd.DataFrame:
        """Table that the supplier fills in: rows for one sample, the state already there."""
        names = FILL_IN[self.language.value]
        part, batch, direction, preload, amplitude, frequency, angle = names
        units = {preload: "N", amplitude: "mm", frequency: "Hz", angle: "°"}
        rows = [
            {
                part: "",
                batch: "",
                direction: asked.name,
                f"{preload} [{units[preload]}]": _nan(asked.preload_n),
                f"{amplitude} [{units[amplitude]}]": _nan(asked.amplitude_mm),
                f"{frequency} [{units[frequency]}]": _nan(asked.frequency_hz),
                **{f"{stiffness} [N/mm]": NAN for stiffness in STIFFNESS},
                f"{angle} [{units[angle]}]": NAN,
            }
            for _ in range(self.sources.programme.process.parts_per_sample)
            for asked in self.tested
        ]
        return pd.DataFrame(rows)

    @cached_property
    def process(self) -> pd.DataFrame:
        """What the process must show for every line of the test."""
        say, asked = self.say, self.sources.programme.process
        n, usual = asked.parts_per_sample, asked.cpk
        demands = [(say("usual", "üblich"), usual, ABOVE * usual)]
        share = self.specification.share_stated
        if share is not None and self.tested:
            box = self.sources.box
            limited = [d for d in self.directions if box and box.variable(d.name).required]
            needed = asked_capability(share, max(len(limited), 1))
            demands.insert(0, (say("acoustics", "Akustik"), needed, max(usual, ABOVE * needed)))
        rows = []
        for line in self.tested:
            low, high = _nan(line.lower), _nan(line.upper)
            half = 0.5 * (high - low) * _nan(line.today_n_per_mm)
            for name, cpk, runs_at in demands:
                rows.append(
                    {
                        say("direction", "Richtung"): line.name,
                        say("asked by", "gefordert von"): name,
                        say("Cpk at least [1]", "Cpk mindestens [1]"): cpk,
                        say("σ in the middle at most [N/mm]", "σ in der Mitte höchstens [N/mm]"): (
                            half / (3.0 * cpk)
                        ),
                        say("σ at most [%]", "σ höchstens [%]"): (
                            PERCENT * (high - low) / (high + low) / (3.0 * cpk)
                        ),
                        say(
                            f"Cpk that {n} parts must show [1]", f"Cpk, den {n} Teile zeigen [1]"
                        ): (measured_capability(cpk, n, CONFIDENCE)),
                        say("if the process runs at Cpk [1]", "läuft der Prozess mit Cpk [1]"): (
                            runs_at
                        ),
                        say("so many parts prove it", "beweisen es so viele Teile"): (
                            proving_parts(cpk, runs_at, CONFIDENCE)
                        ),
                    }
                )
        return pd.DataFrame(rows)

    @cached_property
    def worth(self) -> pd.DataFrame:
        """What stiffness and tolerance of every direction are worth in the cabin."""
        say, sure, rows = self.say, self.effects.certainty, []
        important = self.effects.importance
        for direction in self.directions:
            if direction.need in (Need.nothing, Need.unknown):
                continue
            column = direction.column
            rows.append(
                {
                    say("direction", "Richtung"): direction.name,
                    say("level, 10 % stiffer [dB]", "Pegel, 10 % steifer [dB]"): (
                        self.effects.slope[column]
                    ),
                    "± 90 % [dB]": float(sure["slope"].half_width[column]),
                    say(
                        "scatter σ saved per 1 % tolerance [0.001 dB]",
                        "Streuung σ je 1 % Toleranz [0,001 dB]",
                    ): MILLI * self.effects.tolerance_gain[column],
                    say("± 90 % [0.001 dB]", "± 90 % [0,001 dB]"): MILLI
                    * float(sure["gain"].half_width[column]),
                    say("share of the variance, alone [%]", "Anteil der Varianz, allein [%]"): (
                        PERCENT * max(float(important.first[column, 0]), 0.0)
                    ),
                    say("with others [%]", "mit anderen [%]"): (
                        PERCENT * float(important.total[column, 0])
                    ),
                    "± 95 % [%]": PERCENT * float(important.total_interval[column, 0]),
                }
            )
        return pd.DataFrame(rows)

    @cached_property
    def levels(self) -> pd.DataFrame:
        """Mean level of the vehicles today, in the best design, and in the middle of the bands."""
        say, study, effects = self.say, self.study, self.effects
        today = float(study.index(study.space.nominal[np.newaxis]).mean() * study.per_vehicle)
        other = effects.other_motion()
        names = list(effects.designs)
        label = {
            self.mount.name: say("only this part at nominal", "nur dieses Teil im Nennwert"),
            ALL: say("all parts at nominal", "alle Teile im Nennwert"),
            PICKED: say("best design of the search", "bester Entwurf der Suche"),
        }
        motion = {"prescribed": "vorgegebene Bewegung", "coupled": "gekoppelte Bewegung"}
        rows: list[dict[str, object]] = []
        for name in ("", self.mount.name, ALL, PICKED):
            change = float(effects.change[name].mean()) if name else 0.0
            interval = effects.certainty["change"]
            half = float(interval.half_width[names.index(name)]) if name else NAN
            row: dict[str, object] = {
                say("design", "Entwurf"): label.get(name, say("today", "heute")),
                say("mean level [dB(A)]", "mittlerer Pegel [dB(A)]"): today + change,
                say("change [dB]", "Änderung [dB]"): change if name else NAN,
                say("± 90 %, measurements [dB]", "± 90 %, Messungen [dB]"): half,
            }
            if other is not None:
                kind, changes = other
                named = say(f"change, {kind} motion", f"Änderung, {motion.get(kind, kind)}")
                row[f"{named} [dB]"] = changes.get(name, NAN)
            rows.append(row)
        return pd.DataFrame(rows)

    @cached_property
    def programme(self) -> pd.DataFrame:
        """Fields of the programme: field, value; an empty value has not been given."""
        say, programme = self.say, self.sources.programme
        known, test = programme.mount(self.mount.name), programme.test
        zero = {"unloaded": "unbelastet", "under weight": "unter Gewicht", None: ""}
        further = (test.frequencies_hz or ())[1:]
        conditioning, weight = known.conditioning_force_n or (), known.weight_force_n or ()
        pieces = len(self.mount.pieces)
        variants = [v for v in programme.variants if self.mount.name in v.mounts]
        if self.secrets and variants:
            shown = str(len(variants))
        else:
            shown = "; ".join(f"{v.name}: {v.vehicles_per_year}" for v in variants)
        values = {
            say("part number", "Teilenummer"): known.part_number or "",
            say("drawing", "Zeichnung"): known.drawing_number or "",
            say("revision", "Änderungsstand"): known.revision or "",
            say("pieces per vehicle", "Stück je Fahrzeug"): str(pieces),
            say("parts per year", "Teile je Jahr"): str(known.parts_per_year or ""),
            say("variants, vehicles per year", "Varianten, Fahrzeuge je Jahr"): shown,
            say("contact", "Ansprechpartner"): programme.contact or "",
            say("prototypes", "Prototypen"): programme.prototypes or "",
            say("start of production", "Serienanlauf"): programme.start_of_production or "",
            say("temperature [°C]", "Temperatur [°C]"): _text(test.temperature_c),
            say("conditioning cycles", "Vorkonditionierung, Zyklen"): _text(
                test.conditioning_cycles
            ),
            say("conditioned up to x, y, z [N]", "vorkonditioniert bis x, y, z [N]"): self._listed(
                conditioning, 0
            ),
            say("further frequencies [Hz]", "weitere Frequenzen [Hz]"): self._listed(further, 1),
            say("measuring uncertainty, 95 % [%]", "Messunsicherheit, 95 % [%]"): (
                "" if test.uncertainty is None else f"{PERCENT * test.uncertainty:g}"
            ),
            say("weight force x, y, z [N]", "Gewichtskraft x, y, z [N]"): self._listed(weight, 0),
            say("zero of the static curve", "Nullpunkt der statischen Kennlinie"): say(
                known.curve_zero or "", zero[known.curve_zero]
            ),
        }
        fields, entries = say("field", "Feld"), say("value", "Wert")
        return pd.DataFrame({fields: list(values), entries: list(values.values())})

    @cached_property
    def missing(self) -> tuple[str, ...]:
        """Fields of the programme that have not been given."""
        fields, values = (self.programme.iloc[:, column].tolist() for column in (0, 1))
        return tuple(f for f, value in zip(fields, values, strict=True) if not value)

    @cached_property
    def variants(self) -> pd.DataFrame:
        """Part numbers that vehicles share, with their stiffness and whether the band has it."""
        table, rows = self.sources.shared, []
        if table is None:
            return pd.DataFrame()
        asked = {d.name: d for d in self.specification.directions}
        own = table[table["direction"].isin(asked)]
        for number, lines in own.groupby("part number", sort=False):
            row: dict[str, object] = {
                self.say("part number", "Teilenummer"): number,
                self.say("vehicles", "Fahrzeuge"): self._vehicles(str(lines["vehicles"].iloc[0])),
            }
            outside = []
            for name, factor in zip(lines["direction"], lines["stiffness factor [1]"], strict=True):
                today, band = _nan(asked[name].today_n_per_mm), self.bands[name]
                row[f"{name} [N/mm]"] = float(factor) * today
                if band is not None and not band[0] <= float(factor) <= band[1]:
                    outside.append(name)
            words = self.say("no: ", "nein: ") + ", ".join(outside)
            row[self.say("inside the bands", "in den Bändern")] = (
                words if outside else self.say("yes", "ja")
            )
            rows.append(row)
        return pd.DataFrame(rows)

    def _vehicles(self, names: str) -> str:
        """Return a list of vehicles; of an anonymous one their number."""
        listed = [name.strip() for name in names.split(",")]
        if self.secrets:
            return str(len(listed))
        return ", ".join(listed)

    def _listed(self, values: tuple[float, ...], decimals: int) -> str:
        return "; ".join(f"{value:.{decimals}f}" for value in values)

    @cached_property
    def basis(self) -> pd.DataFrame:
        """What the sheet follows from: item and value."""
        say, study, box = self.say, self.study, self.sources.box
        low, high = study.band
        items = {
            say("bands", "Bänder"): self.rests_on,
            say("lines", "Linien"): f"{low:g}–{high:g} Hz",
        }
        for case, weight in study.load_cases:
            title = case.name if self.secrets else case.title
            load = say("load case", "Lastfall")
            items[f"{load} {case.name}"] = f"{title}; {weight:g}"
        if box is not None:
            again = box.share_measured_again
            items[say("share kept", "eingehaltener Anteil")] = (
                f"{self.percent(box.share_verified)}, ≥ {self.percent(box.share_bound)} "
                f"({self.percent(box.confidence)}), {box.n_parts}"
            )
            if again is not None:
                label = say("share if measured again", "Anteil bei neuer Messung")
                items[label] = f"{self.percent(again[0])} … {self.percent(again[1])} (90 %)"
            if not self.secrets:
                for response in box.responses:
                    label = say("limit of", "Grenzwert von")
                    items[f"{label} {response.name}"] = f"{response.limit:.2f} {box.unit}"
            items[say("acceptance box", "Abnahmebox")] = self.specification.box_sha256
        items[say("run", "Lauf")] = study.run.entry.name
        items[say("design", "Entwurf")] = design_name(study.pick)
        items[say("vehicles", "Fahrzeuge")] = (
            str(len(study.vehicles)) if self.secrets else ", ".join(study.vehicles)
        )
        items[say("checksum of this sheet", "Prüfsumme dieses Blatts")] = (
            self.specification.checksum
        )
        return pd.DataFrame(
            {say("item", "Angabe"): list(items), say("value", "Wert"): list(items.values())}
        )

    @property
    def rests_on(self) -> str:
        """What the bands rest on, in one line."""
        box, say = self.sources.box, self.say
        if box is not None:
            of = say(
                "parts, in all vehicles," if box.together else "parts and vehicles",
                "Teile in allen Fahrzeugen" if box.together else "Teile und Fahrzeuge",
            )
            share, bound = self.percent(box.share_stated), self.percent(box.share_bound)
            limit = say("the noise limit", "den Geräuschgrenzwert")
            below = box.limit_below_today_db
            if below is not None:
                less = say(f" less {below:g} dB", f" weniger {below:g} dB") if below else ""
                limit += say(
                    f" (each vehicle's level of today{less})",
                    f" (heutiger Pegel jedes Fahrzeugs{less.replace('.', ',')})",
                )
            return say(
                f"acceptance box: {share} of {of} keep {limit}, verified: at least {bound}",
                f"Abnahmebox: {share} der {of} halten {limit}, geprüft: mindestens {bound}",
            )
        if self.sources.tolerance:
            return say(
                "tolerance allocation about the best design; no acceptance box was made",
                "Toleranzaufteilung um den besten Entwurf; keine Abnahmebox vorhanden",
            )
        half = PERCENT * float(self.study.space.tolerance.max())
        return say(
            f"± {half:.0f} % of the search, not asked for",
            f"± {half:.0f} % der Suche, nicht gefordert",
        )

    @cached_property
    def changes(self) -> dict[tuple[int, str], str]:
        """Cells of the data block that an older sheet had otherwise, with their former text."""
        old = self.sources.since
        if old is None:
            return {}
        if old.mount != self.mount.name:
            raise InputError(
                f"--since: that sheet is of mount {old.mount}, this one of {self.mount.name}: give "
                f"the older sheet with --mount {old.mount}"
            )
        before, found = {d.name: d for d in old.directions}, {}
        for row, asked in enumerate(self.specification.directions):
            was = before.get(asked.name)
            former = {} if was is None else self._fields(was)
            for label, now in self._fields(asked).items():
                then = former.get(label, "–")
                if isinstance(now, float) and isinstance(then, float):
                    gone = np.isnan(then) and not np.isnan(now)
                    if (
                        gone
                        or abs(now - then) > MOVED * abs(then)
                        or np.isnan(now) > np.isnan(then)
                    ):
                        found[row, label] = "–" if gone else f"{then:.4g}"
                elif now != then:
                    found[row, label] = str(then)
        return found

    @cached_property
    def curves(self) -> pd.DataFrame:
        """Points of the curves of the figure."""
        rows = []
        for asked in self.specification.directions:
            state = self.states.get(asked.name)
            if state is None or asked.today_n_per_mm is None:
                continue
            backed = np.isfinite(state.curve[1])
            x, today = state.curve[0][backed], N_PER_MM * state.curve[1][backed]
            unit = "N" if state.over_force else "N m"
            of = {self.say("direction", "Richtung"): asked.name}
            values = {
                self.say("preload", "Vorlast"): x,
                self.say("unit", "Einheit"): unit,
                self.say("today [N/mm]", "heute [N/mm]"): today,
                self.say("from [N/mm]", "von [N/mm]"): _nan(asked.lower) * today,
                self.say("to [N/mm]", "bis [N/mm]"): _nan(asked.upper) * today,
            }
            rows.append(pd.DataFrame({**of, **values}))
        return pd.concat(rows, ignore_index=True) if rows else pd.DataFrame()

    @cached_property
    def tables(self) -> dict[str, pd.DataFrame]:
        """All tables, by the name of their sheet in the workbook."""
        say, cells = self.say, self.specification.cells
        moved = [
            {
                say("direction", "Richtung"): self.directions[row].name,
                say("field", "Feld"): label,
                say("was", "vorher"): was,
            }
            for (row, label), was in self.changes.items()
        ]
        found = {
            say("data block", "Datenblock"): self.block,
            say("test", "Prüfung"): self.test,
            MEASURED[self.language.value]: self.to_fill_in,
            say("process", "Prozess"): self.process,
            say("worth", "Nutzen"): self.worth,
            say("levels", "Pegel"): self.levels,
            say("programme", "Programm"): self.programme,
            say("part numbers", "Teilenummern"): self.variants,
            say("basis", "Grundlage"): self.basis,
            say("changes", "Änderungen"): pd.DataFrame(moved),
            say("curves", "Kennlinien"): self.curves,
            DATA_SHEET: pd.DataFrame({"entry": list(cells), "value": list(cells.values())}),
        }
        return {name: table for name, table in found.items() if len(table)}


def _known(value: float, decimals: int) -> float | None:
    return round(value, decimals) if np.isfinite(value) else None


def _nan(value: float | None) -> float:
    return NAN if value is None else value


def _text(value: float | None) -> str:
    return "" if value is None else f"{value:g}"
