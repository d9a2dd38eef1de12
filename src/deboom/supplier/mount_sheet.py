"""The sheet of a powertrain's mount: from a front, its box or tolerances, and the campaign."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import pandas as pd

from deboom import plot
from deboom.arrays import AXES, PERCENT, RealArray
from deboom.files.acceptance import Programme, SheetDirection, SupplierSpecification, box_document
from deboom.files.front_run import design_name
from deboom.mounts.mount import Mount, bracket_softness
from deboom.pages.motion import factor_name
from deboom.pages.supplier_study import Direction, SupplierStudy
from deboom.physics.dynamic_stiffness import N_PER_MM
from deboom.plot.style import INK, MUTED, mount_colours
from deboom.supplier.numbers import ALL, MachineState, SupplierEffects, machine_states
from deboom.supplier.sheet import (
    NAN,
    OVER_FREQUENCY,
    DirectionFacts,
    PartSheet,
    SheetCurves,
    nan_if_none,
    required_capability,
    rounded,
)
from deboom.supplier.sources import SheetSources, bands
from deboom.vehicles.design_factor import Factor, with_brackets
from deboom.vehicles.free_directions import NOTICEABLE, Need

MM, MDB = 1e3, 1e3
"""From m to mm, and from dB to mdB."""
WAYS = {
    "x": (("forward", "nach vorn"), ("rearward", "nach hinten")),
    "y": (("to the left", "nach links"), ("to the right", "nach rechts")),
    "z": (("down", "nach unten"), ("up", "nach oben")),
}
"""Where a negative and a positive force on the body act."""
POINTS = 161
"""Of a static curve that is drawn."""
LINE = 0.5
"""Distance within which a line stands for a frequency of the programme [Hz]."""


@dataclass(frozen=True, eq=False, kw_only=True)
class MountSheet(PartSheet):
    """Sheet of one mount of a powertrain.

    Parameters
    ----------
    study : SupplierStudy
    sources : SheetSources
    effects : SupplierEffects
        Of all mounts, about the middle of all bands.
    mount : Mount
    secrets, language, issued
        As of `PartSheet`.
    """

    study: SupplierStudy
    sources: SheetSources
    effects: SupplierEffects
    mount: Mount

    @property
    def part(self) -> str:
        """Name of the mount."""
        return self.mount.name

    @property
    def title(self) -> str:
        """Head of the page."""
        return self.language.say(
            f"Mount {self.part}: dynamic stiffness for low booming noise",
            f"Lager {self.part}: dynamische Steifigkeit gegen Brummen",
        )

    @property
    def description(self) -> str:
        """The mount in words."""
        return self.language.say(
            self.mount.description, self.mount.description_de or self.mount.description
        )

    @property
    def agreed(self) -> Programme:
        """The programme beside the platform."""
        return self.sources.programme

    @property
    def since(self) -> SupplierSpecification | None:
        """Older sheet of this mount."""
        return self.sources.since

    @property
    def pieces(self) -> int:
        """Pieces per vehicle."""
        return len(self.mount.pieces)

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
        """What is demanded, in the form that is read back."""
        box = self.sources.box
        return self.specified(
            tuple(map(self._demand, self.directions)),
            box_sha256="" if box is None else str(box_document(box)["sha256"]),
            share_stated=None if box is None else box.share_stated,
        )

    @cached_property
    def facts(self) -> tuple[DirectionFacts, ...]:
        """Certainty of today's part, ends that the box sets, and savings."""
        stiffness = self.effects.certainty["stiffness"]
        saving = self.agreed.mount(self.part).saving or {}
        facts = []
        for direction in self.directions:
            place = self.study.directions.index(direction)
            state, half = self.states.get(direction.name), NAN
            if state is not None and direction.need is not Need.unknown:
                half = float(stiffness.half_width[place] / stiffness.value[place])
                half += state.other_axes
            ends, price = self.ends(direction), saving.get(direction.axis, NAN)
            facts.append(DirectionFacts(half, ends, price))
        return tuple(facts)

    @cached_property
    def acoustic_cpk(self) -> float | None:
        """Cpk per limited direction that the share of the box needs [1]."""
        box = self.sources.box
        if box is None:
            return None
        limited = [d for d in self.directions if box.variable(d.name).required]
        return required_capability(box.share_stated, max(len(limited), 1))

    def ends(self, direction: Direction) -> str:
        """Name the ends of the band that a limit sets."""
        box = self.sources.box
        return "" if box is None else box.variable(direction.name).set_by_limit

    def _demand(self, direction: Direction) -> SheetDirection:
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
            loss = self._loss_change(direction.name)
            loss *= state.stiffness.imag / state.stiffness.real
        state = state if band is not None else None
        return SheetDirection(
            name=direction.name,
            duty=duty,  # type: ignore[arg-type]
            lower=None if band is None else band[0],
            upper=None if band is None else band[1],
            today_n_per_mm=today,
            loss_factor=rounded(loss if loss > 0.0 else NAN, 4),
            preload_n=rounded(state.preload if state else NAN, 0),
            preload_mm=rounded(MM * state.deflection if state else NAN, 2),
            amplitude_mm=rounded(MM * state.amplitude if state else NAN, 4),
            frequency_hz=rounded(state.frequency if state else NAN, 2),
            static_rate_n_per_mm=rounded(
                N_PER_MM * factor * state.static_rate if state and today else NAN, 1
            ),
        )

    def _loss_change(self, name: str) -> float:
        """Return the loss factor of a direction's new part over that of today's [1]."""
        (changed,) = (d.loss_column for d in self.directions if d.name == name)
        return 1.0 if changed is None else float(self.study.wanted[changed])

    @cached_property
    def worth(self) -> pd.DataFrame:
        """What stiffness and tolerance of every direction are worth in the cabin."""
        sure, important, rows = self.effects.certainty, self.effects.importance, []
        for direction in self.directions:
            if direction.need in (Need.nothing, Need.unknown):
                continue
            column = direction.column
            rows.append(
                {
                    "direction": direction.name,
                    "slope": self.effects.slope[column],
                    "slope_half_width": float(sure["slope"].half_width[column]),
                    "gain": MDB * self.effects.tolerance_gain[column],
                    "gain_half_width": MDB * float(sure["gain"].half_width[column]),
                    "first": PERCENT * max(float(important.first[column, 0]), 0.0),
                    "total": PERCENT * float(important.total[column, 0]),
                    "total_half_width": PERCENT * float(important.total_interval[column, 0]),
                }
            )
        return pd.DataFrame(rows)

    @cached_property
    def levels(self) -> pd.DataFrame:
        """Mean level of the vehicles today and in the middle of the bands; anonymous: changes."""
        study, effects = self.study, self.effects
        today = float(
            study.mean(study.index(study.space.nominal[np.newaxis])[0]) * study.per_vehicle
        )
        other, names = effects.other_motion(), list(effects.designs)
        expected = effects.expected
        stated: dict[str, RealArray] = {}
        if not isinstance(expected, str):
            mean = expected.mean
            bounds = np.column_stack([mean.expected, mean.low, mean.high])
            stated = {"": np.full(3, NAN), **dict(zip(names, bounds, strict=True))}
        words = {"": "design today", self.part: "design part", ALL: "design all"}
        rows: list[dict[str, object]] = []
        for name, word in words.items():
            if self.secrets and not name:
                continue
            change = float(study.mean(effects.change[name])) if name else 0.0
            interval = effects.certainty["change"]
            row: dict[str, object] = {"design": self.word(word), "level": today + change}
            if stated:
                keys = ("expected_change", "expected_low", "expected_high")
                row |= dict(zip(keys, stated[name].tolist(), strict=True))
            row["change"] = change if name else NAN
            row["change_half_width"] = (
                float(interval.half_width[names.index(name)]) if name else NAN
            )
            if other is not None:
                row["other_model"] = other[1].get(name, NAN)
            rows.append(row)
        if self.sources.box is not None:
            wanted = {"design": self.word("design wanted"), "level": today + self._wanted_change}
            rows.append({**wanted, "change": self._wanted_change})
        table = pd.DataFrame(rows)
        return table.drop(columns="level") if self.secrets else table

    @property
    def worth_words(self) -> str:
        """What both tables show."""
        text = self.language.say(
            "Mean level of the vehicles at the driver's ear, mean over the lines. ± 90 % holds "
            "errors of all measurements; effects of parts do not simply add. Share of the variance "
            "of that level while all stiffnesses vary: of this one alone, and with others (Sobol).",
            "Mittlerer Pegel der Fahrzeuge am Fahrerohr über alle Frequenzen. ± 90 % enthält die "
            "Fehler aller Messungen; Wirkungen von Teilen addieren sich nicht einfach. Anteil "
            "an der Varianz dieses Pegels, wenn alle Steifigkeiten variieren: von dieser allein "
            "und mit anderen (Sobol).",
        )
        if isinstance(self.effects.expected, str):
            text += self.language.say(
                " No expected change follows from this model and these data: the model's own error "
                "is not in ±.",
                " Aus diesem Modell und diesen Daten folgt keine erwartete Änderung: der Fehler "
                "des Modells selbst ist nicht in ±.",
            )
        else:
            text += self.language.say(
                " Expected is the change in cars, with what bodies, rubber and amplitudes may do.",
                " Erwartet ist die Änderung in Fahrzeugen, mit Einfluss von Karosserien, Gummi und "
                "Amplituden.",
            )
        if self.sources.box is not None:
            text += self._given_up()
        if "other_model" in self.levels:
            text += self.language.say(
                " A second model of the vehicle gives the last column.",
                " Ein zweites Modell des Fahrzeugs gibt die letzte Spalte.",
            )
        return text

    @cached_property
    def _wanted_change(self) -> float:
        """Change of the mean level by the wanted design itself [dB]."""
        study = self.study
        both = study.index(np.stack([study.space.nominal, study.wanted]))
        return float(study.mean(both[1] - both[0]) * study.per_vehicle)

    def _given_up(self) -> str:
        """Say what parts in the middle of all bands give up against the wanted design."""
        wanted, inside = self._wanted_change, float(self.study.mean(self.effects.change[ALL]))
        if inside - wanted < NOTICEABLE:
            return ""
        return self.language.say(
            " What lies between all parts new and the wanted design is given up for the bands.",
            " Was zwischen allen Teilen neu und dem gewünschten Entwurf liegt, kosten die Bänder.",
        )

    @cached_property
    def variants(self) -> pd.DataFrame:
        """Part numbers that vehicles share, with their stiffness and whether the band has it."""
        table, rows = self.sources.shared, []
        if table is None:
            return pd.DataFrame()
        demands = {d.name: d for d in self.specification.directions}
        mine = table[table["direction"].isin(demands)]
        for number, lines in mine.groupby("part number", sort=False):
            stated, outside = [], []
            factors = lines["stiffness factor [1]"].astype(float)
            for name, factor in zip(lines["direction"], factors, strict=True):
                band, today = self.bands[name], demands[name].today_n_per_mm
                if band is None:
                    continue
                in_mm = "" if today is None else f", {factor * today:.0f} N/mm"
                stated.append(f"{name} {self.percent(factor)}{in_mm}")
                outside += [] if band[0] <= factor <= band[1] else [name]
            inside = f"{self.word('no')}: {', '.join(outside)}" if outside else self.word("yes")
            rows.append(
                {
                    "part_number": number,
                    "vehicles": self._vehicles(str(lines["vehicles"].iloc[0])),
                    "stated": "; ".join(stated),
                    "inside": inside,
                }
            )
        return pd.DataFrame(rows)

    def _vehicles(self, names: str) -> str:
        """Return a list of vehicles; of an anonymous one their number."""
        listed = [name.strip() for name in names.split(",")]
        if self.secrets:
            return str(len(listed))
        return ", ".join(listed)

    @cached_property
    def origin(self) -> dict[str, str]:
        """What the sheet follows from: item and value; an anonymous one names no run or level."""
        say, study, box = self.language.say, self.study, self.sources.box
        low, high = study.band
        items = {say("lines", "Linien"): f"{low:g}–{high:g} Hz"}
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
        if not self.secrets:
            items[say("run", "Lauf")] = study.run.entry.name
            items[say("design", "Entwurf")] = design_name(study.pick)
        items[say("vehicles", "Fahrzeuge")] = (
            str(len(study.vehicles)) if self.secrets else ", ".join(study.vehicles)
        )
        return items

    @property
    def rests_on(self) -> str:
        """What the bands rest on, in one line."""
        box, say = self.sources.box, self.language.say
        if box is not None:
            of = say(
                "parts, in all vehicles," if box.together else "parts and vehicles",
                "Teile in allen Fahrzeugen" if box.together else "Teile und Fahrzeuge",
            )
            share, bound = self.percent(box.share_stated), self.percent(box.share_bound)
            limit = say("the noise limit", "den Geräuschgrenzwert")
            below = box.limit_below_today_db
            if box.gain_kept is not None:
                kept = self.percent(box.gain_kept)
                limit += say(
                    f" ({kept} of what the wanted design brings each vehicle)",
                    f" ({kept} dessen, was der gewünschte Entwurf jedem Fahrzeug bringt)",
                )
            if below is not None:
                less = say(f" less {below:g} dB", f" weniger {below:g} dB") if below else ""
                limit += say(
                    f" (each vehicle's level of today{less})",
                    f" (heutiger Pegel jedes Fahrzeugs{less.replace('.', ',')})",
                )
            rubber = self.percent(box.common)
            return say(
                f"acceptance box: {share} of {of} keep {limit}, verified: at least {bound}",
                f"Abnahmebox, {share} der {of} halten {limit}, geprüft: mindestens {bound}",
            ) + (
                say(
                    f"; all rubber ± {rubber} together in the cars",
                    f"; aller Gummi im Fahrzeug zugleich ± {rubber}",
                )
                if box.common
                else ""
            )
        if self.sources.tolerance:
            return say(
                "tolerance allocation about the wanted design; no acceptance box was made",
                "Toleranzaufteilung um den gewünschten Entwurf; keine Abnahmebox vorhanden",
            )
        half = PERCENT * float(self.study.space.tolerance.max())
        return say(
            f"tolerance of ± {half:.0f} % about the wanted design; no limit demands it",
            f"Toleranz von ± {half:.0f} % um den gewünschten Entwurf; kein Grenzwert fordert es",
        )

    @cached_property
    def notes(self) -> tuple[str, ...]:
        """Say what the data block holds for."""
        say, demands = self.language.say, self.specification.directions
        of_part = factor_name(self.study.index) == Factor.part.value
        states = [self.states[d.name] for d in demands if d.name in self.states and d.lower]
        texts = [
            say("The band rests on the ", "Grundlage des Bandes: ") + self.rests_on + ".",
            say(
                "The rubber itself is scaled, its force at every deflection; the stops stay."
                if of_part
                else "The whole curve over static force is scaled alike: stops are to be re-tuned.",
                "Skaliert wird der Gummi selbst, seine Kraft bei jeder Einfederung, ohne die "
                "Anschläge."
                if of_part
                else "Die ganze Kennlinie über der statischen Kraft wird gleich skaliert: "
                "Anschläge neu abstimmen.",
            ),
            self._preload_words(states),
        ]
        if self.mount.brackets:
            texts.append(self._bracket_words())
        if any(not state.laboratory for state in states):
            texts.append(
                say(
                    "An amplitude that is no usual one of laboratories is the vehicle's: nothing "
                    "was measured at a laboratory's there.",
                    "Eine laborunübliche Amplitude ist die des Fahrzeugs: bei einer Laboramplitude "
                    "wurde dort nichts gemessen.",
                )
            )
        nothing = [d.name for d in self.directions if d.need is Need.nothing]
        unknown = [d.name for d in demands if d.duty == "not identified"]
        ratio = [d.name for d in demands if d.duty == "must" and d.today_n_per_mm is None]
        for names, english, german in (
            (
                nothing,
                "no demand from booming; demands of the drawing on handling, durability and "
                "travel stay.",
                "keine Forderung aus dem Brummen; Fahrverhalten, Lebensdauer und Wegbegrenzung der "
                "Zeichnung bleiben.",
            ),
            (
                unknown,
                "not identified: the measurement is too uncertain to demand a number; please keep "
                "today's stiffness.",
                "nicht identifiziert: zu unsicher gemessen, um eine Zahl zu fordern; bitte die "
                "heutige Steifigkeit beibehalten.",
            ),
            (
                ratio,
                "only as a share of today's part, measured on one machine.",
                "nur als Anteil des heutigen Teils, auf derselben Maschine.",
            ),
        ):
            if names:
                texts.append(f"{', '.join(names)}: {say(english, german)}")
        return tuple(texts)

    def _bracket_words(self) -> str:
        """Say what the wanted factors make of the mount with its brackets."""
        (case, _), *_ = self.study.load_cases
        softness = bracket_softness(self.mount, case, self.study.band)
        at = [AXES.index(direction.axis) for direction in self.directions]
        rubber = self.effects.middle[[direction.column for direction in self.directions]]
        both = with_brackets(rubber, softness[at])
        of_each = "; ".join(
            f"{direction.name} {self.percent(round(mine, 2))} → {self.percent(round(joined, 2))}"
            for direction, mine, joined in zip(self.directions, rubber, both, strict=True)
            if self.bands[direction.name] is not None and not np.isnan(joined)
        )
        return self.language.say(
            "The part is tested without the brackets that hold it in the car. Share of today's "
            f"stiffness, of the rubber → with its brackets: {of_each}.",
            "Das Teil wird ohne die Halter geprüft, an denen es im Fahrzeug sitzt. Anteil der "
            f"heutigen Steifigkeit, vom Gummi → mit seinen Haltern: {of_each}.",
        )

    def _preload_words(self, states: list[MachineState]) -> str:
        """Say what the preloads contain, and where their deflection counts from."""
        say = self.language.say
        axes = say("Forces act on the body.", "Kräfte wirken auf die Karosserie.")
        moved = ", ".join(
            f"{state.direction.name} {say(*WAYS[state.direction.axis][state.preload > 0.0])}"
            for state in states
            if abs(state.preload) > 0.0
        )
        if moved:
            axes += say(
                f" With the body side clamped, the preload moves the other side: {moved}; the "
                "drawing shows, by how the part is fitted, whether that is tension or compression.",
                f" Bei eingespannter Karosserieseite bewegt die Vorlast die andere Seite: {moved}; "
                "die Einbaulage der Zeichnung zeigt, ob das Zug oder Druck ist.",
            )
        if not states:
            return axes
        if not any(state.over_force for state in states):
            torque = max(state.wheel_torque for state in states)
            if not np.isfinite(torque):
                return axes
            return axes + say(
                f" Preload: that of {torque:.0f} N m wheel torque; newtons are to be agreed.",
                f" Vorlast: die von {torque:.0f} N m Radmoment; Newton noch zu vereinbaren.",
            )
        unloaded = all(state.from_unloaded for state in states)
        weight = self.agreed.mount(self.part).weight_force_n
        if weight is not None and not any(weight):
            loads = say(
                "torque alone (this part carries no weight)",
                "nur Drehmoment (dieses Teil trägt kein Gewicht)",
            )
        elif weight is not None:
            loads = say("weight and torque together", "Gewicht und Drehmoment zusammen")
        else:
            loads = say("torque only", "nur Drehmoment")
        return axes + say(
            f" Preload: {loads}"
            + (", from the unloaded part." if unloaded else ", from the position under weight."),
            f" Vorlast: {loads}"
            + (", vom unbelasteten Teil aus." if unloaded else ", von der Lage unter Gewicht aus."),
        )

    @property
    def classes(self) -> str:
        """What the classes mean, with the amount that nobody hears."""
        amount = f"{NOTICEABLE:g}"
        return self.language.say(
            "Must: accepted only inside the band; the noise limit sets at least one end of it. "
            "Preferred: wanted, but no limit depends on it. Free: today's part is good enough; "
            "anywhere in the band this direction alone changes no mean level and no booming peak "
            f"of a vehicle by more than {amount} dB.",
            "Muss: zulässig nur im Band, von dem ein Ende durch den Geräuschgrenzwert gesetzt ist. "
            "Bevorzugt: gewünscht, kein Grenzwert hängt davon ab. Frei: das heutige Teil genügt; "
            f"im Band ändert es allein kein Fahrzeug um mehr als {amount.replace('.', ',')} dB, "
            "weder im mittleren Pegel noch an einer Brummspitze.",
        )

    @property
    def glossary(self) -> tuple[str, ...]:
        """Words that a reader may not know."""
        return (
            self.language.say(
                "Static rate: slope of the wanted static curve at the preload. Booming: low drone "
                "in the cabin at full load and low engine speed.",
                "Statische Rate: Steigung der gewünschten statischen Kennlinie bei der Vorlast. "
                "Brummen: tiefer Ton im Innenraum bei Volllast und niedriger Drehzahl.",
            ),
        )

    @cached_property
    def curves(self) -> SheetCurves:
        """Today's part and the band of every direction, dynamic and static."""
        say = self.language.say
        driven, now = say("today, in the vehicle", "heute, im Fahrzeug"), self.word("design today")
        nominal, band = say("new", "neu"), say("band", "Band")
        second = say("new, second amplitude", "neu, zweite Amplitude")
        colour = mount_colours([m.name for m in self.study.platform.mounts])[self.part]
        panels, points = [], []
        for demand in self.specification.directions:
            state = self.states.get(demand.name)
            if state is None or demand.today_n_per_mm is None:
                continue
            labels = (driven, now, nominal, band)
            drawn = [self._dynamic_panel(demand, state, labels)]
            if state.over_frequency:
                drawn.append(self._frequency_panel(demand, state, (*labels[1:], second)))
            if state.static is not None:
                drawn.append(self._static_panel(demand, state, labels))
            panels += [panel for panel, _ in drawn if panel is not None]
            points += [rows for _, rows in drawn]
        return SheetCurves(
            axes={
                say("x rearward", "x nach hinten"): (1.0, 0.0, 0.0),
                say("y right", "y rechts"): (0.0, 1.0, 0.0),
                say("z up", "z oben"): (0.0, 0.0, 1.0),
            },
            axes_caption=self._axes_words(),
            panels=panels,
            dashed=(now,),
            colours={driven: MUTED, now: INK, nominal: colour, second: colour, band: colour},
            points=pd.concat(points, ignore_index=True) if points else pd.DataFrame(),
            caption=say(
                "Grey dots: today's part in the vehicle, at the amplitudes and the torque there. "
                "Curves: today's part, the new part and the band at the state above each panel, "
                "within what was measured. Dot on the curve of the new part: the test.",
                "Graue Punkte: heutiges Teil im Fahrzeug, bei den Amplituden und dem Drehmoment "
                "dort. Kurven: heutiges Teil, neues Teil und Band bei dem Zustand über jedem Bild, "
                "soweit gemessen. Punkt auf der Kurve des neuen Teils: die Prüfung.",
            ),
        )

    @cached_property
    def over_frequency(self) -> pd.DataFrame:
        """The new part over frequency, at the amplitude of the test and a second one."""
        rows = []
        for demand in self.specification.directions:
            state = self.states.get(demand.name)
            if state is None or demand.today_n_per_mm is None or not state.over_frequency:
                continue
            low, high = nan_if_none(demand.lower), nan_if_none(demand.upper)
            loss_changed = self._loss_change(demand.name)
            for curve in state.over_frequency:
                for line in self.shown_lines(*self.study.band):
                    at = int(np.argmin(np.abs(curve.frequency - line)))
                    near = abs(curve.frequency[at] - line) <= LINE
                    today = curve.stiffness[at] * N_PER_MM if near else NAN * 1j
                    size = float(abs(today))
                    values = (
                        demand.name,
                        MM * curve.amplitude,
                        line,
                        low * size,
                        0.5 * (low + high) * size,
                        high * size,
                        loss_changed * float(today.imag / today.real),
                    )
                    rows.append(dict(zip(OVER_FREQUENCY, values, strict=True)))
        return pd.DataFrame(rows)

    def _axes_words(self) -> str:
        """Say how the axes of the part stand in the vehicle."""
        turned = [
            f"{self.mount.pieces[piece] or self.part} "
            + "; ".join(f"{np.degrees(angle):.1f}°" for angle in self.mount.rotations[piece])
            for piece in self.mount.tilted_pieces
        ]
        if not turned:
            return self.language.say(
                "The axes of the part are those of the vehicle.",
                "Achsen des Teils wie im Fahrzeug.",
            )
        return self.language.say(
            "Axes of the part, turned about the vehicle's x, y, z: ",
            "Achsen des Teils, gedreht um x, y, z des Fahrzeugs: ",
        ) + ", ".join(turned)

    @property
    def _dynamic_label(self) -> str:
        return self.language.say("dynamic |K| [N/mm]", "|K|, dynamisch [N/mm]")

    def _dynamic_panel(
        self, demand: SheetDirection, state: MachineState, labels: tuple[str, ...]
    ) -> tuple[plot.CurvePanel | None, pd.DataFrame]:
        """Draw |K| over the static force; its points are those that measurements back."""
        driven, now, nominal, band = labels
        backed = np.isfinite(state.curve[1])
        order = np.argsort(state.curve[0][backed], kind="stable")
        x, today = (values[backed][order] for values in state.curve)
        today = N_PER_MM * today
        low, high = nan_if_none(demand.lower), nan_if_none(demand.upper)
        rows = self._points(demand, "dynamic", "N" if state.over_force else "N m", "N/mm")
        rows |= {"abscissa": x, "curve_today": today}
        table = pd.DataFrame(rows | {"curve_lower": low * today, "curve_upper": high * today})
        if not state.points[0].size or not np.all(np.isfinite(state.points[0])):
            return None, table  # a run without engine torque has no preload
        curves: dict[str, RealArray] = {}
        if x.size:
            curves = {now: today, nominal: 0.5 * (low + high) * today}
        tested = {nominal: self._test_point(demand, state)} if x.size else {}
        amplitude = self.language.local(f"{demand.amplitude_mm:g} mm, {demand.frequency_hz:g} Hz")
        panel = plot.CurvePanel(
            demand.name,
            x if x.size else state.points[0],
            curves,
            {driven: (state.points[0], N_PER_MM * state.points[1]), **tested},
            {band: (low * today, high * today)} if x.size else {},
            note=amplitude,
            x_label=self._force_label(state),
            y_label=self._dynamic_label,
        )
        return panel, table

    def _force_label(self, state: MachineState) -> str:
        """Name the axis of a curve over force; curves are of the torque alone."""
        if not state.over_force:
            return self.language.say("wheel torque [N m]", "Radmoment [N m]")
        if any(self.agreed.mount(self.part).weight_force_n or ()):
            return self.language.say("force of the torque [N]", "Kraft des Drehmoments [N]")
        return self.language.say("static force [N]", "statische Kraft [N]")

    def _test_point(
        self, demand: SheetDirection, state: MachineState
    ) -> tuple[list[float], list[float]]:
        """Return where the new part is tested: static force or wheel torque, and |K| [N/mm]."""
        at = state.preload if state.over_force else state.wheel_torque
        weight = self.agreed.mount(self.part).weight_force_n
        if state.over_force and weight is not None:  # curves are of the torque alone
            at -= weight[AXES.index(state.direction.axis)]
        low, high, today = map(nan_if_none, (demand.lower, demand.upper, demand.today_n_per_mm))
        return [at], [0.5 * (low + high) * today]

    def _frequency_panel(
        self, demand: SheetDirection, state: MachineState, labels: tuple[str, ...]
    ) -> tuple[plot.CurvePanel | None, pd.DataFrame]:
        """Draw |K| over frequency at the preload of the test: a curve per amplitude."""
        now, nominal, band, second = labels
        low, high = nan_if_none(demand.lower), nan_if_none(demand.upper)
        middle, tables, of_new = 0.5 * (low + high), [], []
        for curve in state.over_frequency:
            x = curve.frequency[curve.backed]
            size = N_PER_MM * np.abs(curve.stiffness[curve.backed])
            name = f"{self.word('dynamic')}, {MM * curve.amplitude:g} mm"
            rows = self._points(demand, "dynamic", "Hz", "N/mm") | {"curve": name}
            rows |= {"abscissa": x, "curve_today": size}
            tables.append(
                pd.DataFrame(rows | {"curve_lower": low * size, "curve_upper": high * size})
            )
            of_new.append((x, size))
        table = pd.concat(tables, ignore_index=True)
        (x, today), *others = of_new
        if not x.size:
            return None, table
        at_test = nan_if_none(demand.frequency_hz), middle * nan_if_none(demand.today_n_per_mm)
        dots = {nominal: (np.array(at_test[:1]), np.array(at_test[1:]))}
        if others:
            dots[second] = (others[0][0], middle * others[0][1])
        load = f"{state.wheel_torque:.0f} N m"
        if demand.preload_n is not None:
            load = f"{demand.preload_n:.0f} N"
        amplitudes = " · ".join(f"{MM * curve.amplitude:g}" for curve in state.over_frequency)
        panel = plot.CurvePanel(
            demand.name,
            x,
            {now: today, nominal: middle * today},
            dots,
            {band: (low * today, high * today)},
            note=self.language.local(f"{amplitudes} mm, {load}".replace("-", "−")),
            x_label=self.language.say("frequency [Hz]", "Frequenz [Hz]"),
            y_label=self._dynamic_label,
        )
        return panel, table

    def _static_panel(
        self, demand: SheetDirection, state: MachineState, labels: tuple[str, ...]
    ) -> tuple[plot.CurvePanel, pd.DataFrame]:
        """Draw the static force over the deflection: today's part, and what the band makes of it.

        Where the dynamic stiffness is scaled at every force, a curve keeps its forces and is
        compressed along the deflection; where the part is scaled, forces are.
        """
        static = state.static
        assert static is not None
        _, now, nominal, band = labels
        low, high = nan_if_none(demand.lower), nan_if_none(demand.upper)
        over = np.linspace(static.lowest, static.highest, POINTS)

        def scaled(factor: float) -> RealArray:
            if factor_name(self.study.index) == Factor.part.value:
                return factor * static.force(over)
            inside = np.clip(factor * over, static.lowest, static.highest)
            values = static.force(inside)
            return np.where(inside == factor * over, values, NAN)

        today = static.force(over)
        ends = np.array([scaled(factor) for factor in (low, high, 0.5 * (low + high))])
        shown = np.isfinite(ends).all(axis=0)
        x = MM * over[shown]
        at_state: dict[str, tuple[list[float], list[float]]] = {}
        force, moved = demand.preload_n, demand.preload_mm
        from_zero = not state.with_weight or state.from_unloaded
        if force is not None and moved is not None and from_zero:
            at_state = {nominal: ([moved], [force])}
        lower, upper = ends[:2, shown].min(axis=0), ends[:2, shown].max(axis=0)
        rows = self._points(demand, "static", "mm", "N")
        rows |= {"abscissa": x, "curve_today": today[shown]}
        panel = plot.CurvePanel(
            demand.name,
            x,
            {now: today[shown], nominal: ends[2, shown]},
            at_state,
            ranges={band: (lower, upper)},
            x_label=self.language.say("deflection [mm]", "Einfederung [mm]"),
            y_label=self.language.say("static force [N]", "statische Kraft [N]"),
        )
        return panel, pd.DataFrame(rows | {"curve_lower": lower, "curve_upper": upper})

    def _points(
        self, demand: SheetDirection, curve: str, unit: str, ordinate: str
    ) -> dict[str, object]:
        """Begin the rows of a curve."""
        head = {"direction": demand.name, "curve": self.word(curve)}
        return {**head, "unit": unit, "ordinate_unit": ordinate}
