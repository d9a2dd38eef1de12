"""Page and workbook of a mount supplier's sheet."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path

import numpy as np

from deboom import plot
from deboom.arrays import RealArray
from deboom.choices import Pick
from deboom.files.disk import made_folder, replace_bytes
from deboom.files.front_run import SupplierStudy
from deboom.files.run_folder import RunEntry
from deboom.files.schema import refuse_all
from deboom.files.tables import workbook_bytes
from deboom.names import path_inside
from deboom.pages.motion import factor_name
from deboom.plot.style import INK, MUTED, mount_colours
from deboom.report.sheet import Sheet
from deboom.supplier.numbers import MachineState
from deboom.supplier.sheet import N_PER_MM, MountSheet
from deboom.supplier.sources import (
    SheetFiles,
    page_text,
    refuse_leaks,
    workbook_text,
)
from deboom.vehicles.design_factor import Factor
from deboom.vehicles.free_directions import NOTICEABLE, Need

SHORT_HASH = 12
"""Characters of a hash that a sheet shows."""
WAYS = {
    "x": (("forward", "nach vorn"), ("rearward", "nach hinten")),
    "y": (("to the left", "nach links"), ("to the right", "nach rechts")),
    "z": (("down", "nach unten"), ("up", "nach oben")),
}
"""Where a negative and a positive force on the body act."""


def sheet_page(content: MountSheet, provenance: str) -> Sheet:
    """Write the two pages of a sheet.

    Parameters
    ----------
    content : MountSheet
    provenance : str
        Command and run, for the foot; empty for an anonymous sheet.
    """
    say, name = content.say, content.mount.name
    page = Sheet(
        say(
            f"Mount {name}: dynamic stiffness for low booming noise",
            f"Lager {name}: dynamische Steifigkeit für wenig Brummen",
        ),
        content.mount.description,
        content.language.value,
    )
    fields = content.programme
    page.fields(dict(zip(fields.iloc[:, 0], fields.iloc[:, 1], strict=True)))
    block = content.block
    page.section(say("Data block", "Datenblock"))
    decimals = dict.fromkeys(block.columns[[2, 3, 4, 7, 11]], 0)
    decimals |= dict(zip(block.columns[[6, 9, 10]], (3, 3, 1), strict=True))
    shown = block.iloc[:, :12].dropna(axis=1, how="all")
    decimals = {label: digits for label, digits in decimals.items() if label in shown}
    page.table(shown, "", decimals, content.changes)
    page.table(
        block.iloc[:, [0, *range(12, 17)]],
        say(
            "Today's part, and the band as its share. ± holds errors of all measurements, and that "
            "in the vehicle all axes move, on a machine one.",
            "Heutiges Teil, und das Band als Anteil. ± enthält die Fehler aller Messungen, und "
            "dass sich im Fahrzeug alle Achsen bewegen, auf der Maschine eine.",
        ),
        {block.columns[12]: 0},
    )
    for text in _words(content, page):
        page.text(text)
    _figure(page, content)

    page.new_page()
    page.section(say("Test of a part", "Prüfung eines Teils"), _test_words(content))
    if len(content.test):
        table = content.test.drop(columns=content.test.columns[2])
        for shown in (table.iloc[:, :8], table.iloc[:, [0, *range(8, table.shape[1])]]):
            known = shown.dropna(axis=1, how="all")
            digits = {str(n): 1 for n in known if str(n).endswith(("[N/mm]", "[Hz]"))}
            page.table(known, "", digits | {str(n): 3 for n in known if str(n).endswith("[mm]")})
        page.section(
            say("What the process must show", "Was der Prozess zeigen muss"),
            say(
                "σ is the standard deviation of a process in the middle of its band. A sample "
                "proves a Cpk if its lower 95 % bound (Bissell) reaches it.",
                "σ ist die Standardabweichung eines Prozesses in der Mitte seines Bandes. Eine "
                "Stichprobe beweist einen Cpk, wenn ihre untere 95-%-Schranke (Bissell) ihn "
                "erreicht.",
            ),
        )
        if content.specification.share_stated is not None:
            page.text(_rules(content, content.specification.share_stated))
        process = content.process
        page.table(process, "", {label: 2 for label in process.columns[[2, 4, 5, 6]]})
    page.section(say("What it is worth", "Was es wert ist"), _worth_words(content))
    if len(content.worth):
        page.table(content.worth, "", dict.fromkeys(content.worth.columns[5:], 1))
    page.table(content.levels)
    if len(content.variants):
        page.section(say("Part numbers", "Teilenummern"))
        page.table(content.variants)
    page.section(say("Words", "Begriffe"))
    for term in _glossary(content):
        page.text(term)
    page.signatures(
        say("Customer: date, signature", "Kunde: Datum, Unterschrift"),
        say("Supplier: date, signature", "Lieferant: Datum, Unterschrift"),
    )
    sum_ = content.specification.checksum[:SHORT_HASH]
    page.foot = say(f"Sheet {sum_}", f"Blatt {sum_}") + provenance
    return page


def _words(content: MountSheet, page: Sheet) -> list[str]:
    """Say what the data block holds for."""
    say, study = content.say, content.study
    part = factor_name(study.index) == Factor.part.value
    asked = content.specification.directions
    nothing = [d.name for d in content.directions if d.need is Need.nothing]
    unknown = [d.name for d in asked if d.duty == "not identified"]
    ratio = [d.name for d in asked if d.duty == "must" and d.today_n_per_mm is None]
    states = [content.states[d.name] for d in asked if d.name in content.states and d.lower]
    texts = [
        say(
            "Must: accepted only inside the band, an end of which is set by the noise limit. "
            "Preferred: asked for, no limit depends on it. Free: today's part will do; anywhere in "
            f"the band, alone, it changes no vehicle by more than {NOTICEABLE:g} dB, neither its "
            "mean level nor a booming peak. The nominal value is the middle of the band; as a "
            "share of today's part the band holds at every preload, amplitude and frequency.",
            "Muss: zulässig nur im Band, von dem ein Ende durch den Geräuschgrenzwert gesetzt ist. "
            "Bevorzugt: gewünscht, kein Grenzwert hängt daran. Frei: das heutige Teil genügt; im "
            f"Band ändert es allein kein Fahrzeug um mehr als {page.local(NOTICEABLE)} dB, weder "
            "im mittleren Pegel noch an einer Brummspitze. Der Nennwert ist die Mitte des Bandes; "
            "als Anteil des heutigen Teils gilt das Band bei jeder Vorlast, Amplitude und "
            "Frequenz.",
        ),
        say("The band rests on the ", "Das Band beruht auf: ") + content.rests_on + ".",
        say(
            "The rubber itself is scaled, its force at every deflection; the stops stay."
            if part
            else "The whole curve over static force is scaled alike: stops are to be re-tuned.",
            "Skaliert wird der Gummi selbst, seine Kraft bei jeder Einfederung, ohne die Anschläge."
            if part
            else "Die ganze Kennlinie über der statischen Kraft wird gleich skaliert: Anschläge "
            "neu abstimmen.",
        ),
        _preload_words(content, states),
    ]
    if any(not state.laboratory for state in states):
        texts.append(
            say(
                "An amplitude that is no usual one of laboratories is the vehicle's: nothing was "
                "measured at a laboratory's there.",
                "Eine laborunübliche Amplitude ist die des Fahrzeugs: bei einer Laboramplitude "
                "wurde dort nichts gemessen.",
            )
        )
    if nothing:
        texts.append(
            say(
                f"{', '.join(nothing)}: no demand from booming; handling, durability and travel "
                "limits of the drawing stay.",
                f"{', '.join(nothing)}: keine Forderung aus dem Brummen; Fahrverhalten, "
                "Lebensdauer und Wegbegrenzung der Zeichnung bleiben.",
            )
        )
    saved = content.block.iloc[:, [0, -1]].dropna()
    for direction, price in saved.itertuples(index=False):
        money = page.number(price, 2, content.sources.programme.currency)
        texts.append(
            say(
                f"{direction} free saves {money} per part.",
                f"{direction} frei spart {money} je Teil.",
            )
        )
    if unknown:
        texts.append(
            say(
                f"{', '.join(unknown)}: not identified, measured too uncertainly to ask for a "
                "number; please leave it as it is.",
                f"{', '.join(unknown)}: nicht identifiziert, zu unsicher gemessen, um eine Zahl zu "
                "fordern; bitte lassen, wie es ist.",
            )
        )
    if ratio:
        texts.append(
            say(
                f"{', '.join(ratio)}: only as a share of today's part, measured on one machine.",
                f"{', '.join(ratio)}: nur als Anteil des heutigen Teils, auf derselben Maschine.",
            )
        )
    if content.changes:
        old = content.sources.since
        assert old is not None
        texts.append(
            say("Marked cells moved since sheet ", "Markierte Zellen sind anders als auf Blatt ")
            + f"{old.checksum[:SHORT_HASH]}"
            + (f" ({old.revision})." if old.revision else ".")
        )
    return texts


def _preload_words(content: MountSheet, states: list[MachineState]) -> str:
    """Say what the preloads contain, and where their deflection counts from."""
    say = content.say
    axes = say(
        "Forces act on the body; x rearward, y to the right, z upward.",
        "Kräfte wirken auf die Karosserie; x nach hinten, y nach rechts, z nach oben.",
    )
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
    weight = all(state.with_weight for state in states)
    unloaded = all(state.from_unloaded for state in states)
    return axes + say(
        " Preload: "
        + ("weight and torque together" if weight else "torque only")
        + (", from the unloaded part." if unloaded else ", from the position under weight."),
        " Vorlast: "
        + ("Gewicht und Drehmoment zusammen" if weight else "nur Drehmoment")
        + (", vom unbelasteten Teil aus." if unloaded else ", von der Lage unter Gewicht aus."),
    )


def _test_words(content: MountSheet) -> str:
    say, guard = content.say, content.specification.uncertainty
    if not content.specification.musts:
        return say(
            "No direction of this part is a must; nothing is held against a limit.",
            "Keine Richtung dieses Teils ist ein Muss; nichts wird an einem Grenzwert gemessen.",
        )
    if guard is None:
        guarded = say(
            "Guarded limits follow once a measuring uncertainty is stated.",
            "Eingeengte Grenzen folgen, sobald eine Messunsicherheit genannt ist.",
        )
    else:
        guarded = say(
            f"Inside the guarded limits it passes for sure with ± {content.percent(guard)} (95 %; "
            "ISO 14253-1, applied once).",
            f"In den eingeengten Grenzen besteht es sicher bei ± {content.percent(guard)} (95 %; "
            "ISO 14253-1, einmal angewandt).",
        )
    return say(
        "Raise the preload, a force, from zero and do not overshoot: rubber remembers, and in the "
        "vehicle torque rises. Set amplitude and frequency; read |K| and the loss angle, or K' and "
        "K'', of each piece. It is accepted between the specification limits of |K|; the loss "
        "angle has none. "
        f"{guarded} Fill in the sheet “measured” of the workbook. Preloads of all directions act "
        "together in the vehicle. Measure a part of today as well (rows “today”) where the machine "
        "sets only one of them, or where ± of today's |K| is too much: then ratios to it count.",
        "Vorlast als Kraft von null aus steigern und nicht überschreiten: Gummi erinnert sich, und "
        "im Fahrzeug steigt das Drehmoment. Amplitude und Frequenz stellen; je Stück |K| und "
        "Verlustwinkel oder K' und K'' ablesen. Es ist zwischen den Spezifikationsgrenzen von |K| "
        f"zulässig; der Verlustwinkel hat keine. {guarded} Bitte das Blatt „gemessen“ der "
        "Arbeitsmappe ausfüllen. Im Fahrzeug wirken die Vorlasten aller Richtungen zusammen. "
        "Stellt die Maschine nur eine, oder ist ± des heutigen |K| zu viel, bitte ein heutiges "
        "Teil mitmessen (Zeilen „heute“): dann zählt das Verhältnis dazu.",
    )


def _rules(content: MountSheet, share: float) -> str:
    """State every rule that a delivery is judged by."""
    stated, say = content.percent(share), content.say
    return say(
        "A batch passes if every measured part lies inside all bands of the class must, beyond "
        f"the measuring uncertainty, and the measured parts show that {stated} of its pieces do: "
        "the lower 5 % end of what they leave open counts. A part too near to an end is undecided. "
        "The customer also predicts the cars: a batch in a corner of the box, near the ends of "
        "several bands at once, is reported to you but passes.",
        "Eine Charge besteht, wenn jedes gemessene Teil über die Messunsicherheit hinaus in allen "
        f"Muss-Bändern liegt und die gemessenen Teile zeigen, dass das für {stated} ihrer Stücke "
        "gilt: es zählt das untere 5-%-Ende dessen, was sie offen lassen. Ein Teil zu nah an einem "
        "Ende ist unentschieden. Der Kunde rechnet auch die Fahrzeuge: eine Charge in einer Ecke "
        "der Box, nahe den Enden mehrerer Bänder zugleich, wird genannt, besteht aber.",
    )


def _worth_words(content: MountSheet) -> str:
    say = content.say
    text = say(
        "Mean level of the vehicles at the driver's ear, mean over the lines. ± 90 % holds errors "
        "of all measurements; effects of parts do not simply add.",
        "Mittlerer Pegel der Fahrzeuge am Fahrerohr, Mittel über die Linien. ± 90 % enthält die "
        "Fehler aller Messungen; Wirkungen von Teilen addieren sich nicht einfach.",
    )
    text += say(
        " Share of the variance of that level, where all stiffnesses of the platform vary within "
        "the search: by this one alone, and with others (Sobol indices).",
        " Anteil an der Varianz dieses Pegels, wenn alle Steifigkeiten im Suchbereich "
        "variieren: durch diese allein, und mit anderen (Sobol-Indizes).",
    )
    if len(content.levels.columns) > 4:
        return text + say(
            " The last column is the same change by the other model of the powertrain's motion: "
            "the difference is the model's own uncertainty.",
            " Die letzte Spalte ist dieselbe Änderung mit dem anderen Modell der Antriebsbewegung: "
            "der Unterschied ist die Unsicherheit des Modells selbst.",
        )
    return text + say(
        " The model of the motion could not be compared with another: its own error is not in ±.",
        " Das Modell der Bewegung konnte mit keinem anderen verglichen werden: sein eigener Fehler "
        "ist nicht in ±.",
    )


def _glossary(content: MountSheet) -> tuple[str, ...]:
    say = content.say
    return (
        say(
            "|K|: magnitude of the complex dynamic stiffness of one piece, force over "
            "displacement; K = K' + jK'', loss factor K''/K', the tangent of the loss angle. "
            "Amplitudes are peak.",
            "|K|: Betrag der komplexen dynamischen Steifigkeit eines Stücks, Kraft durch Weg; "
            "K = K' + jK'', Verlustfaktor K''/K', Tangens des Verlustwinkels. Amplituden sind "
            "Spitzenwerte.",
        ),
        say(
            "Static rate: slope of the wanted static curve at the preload. Cpk: distance of the "
            "mean from the nearer end of the band over three standard deviations. Booming: low "
            "drone in the cabin at full load and low engine speed.",
            "Statische Rate: Steigung der gewünschten statischen Kennlinie bei der Vorlast. Cpk: "
            "Abstand des Mittelwerts vom näheren Ende des Bandes durch drei Standardabweichungen. "
            "Brummen: tiefer Ton im Innenraum bei Volllast und niedriger Drehzahl.",
        ),
    )


def _figure(page: Sheet, content: MountSheet) -> None:
    """Show today's curve and the band of every direction that has one."""
    panels, say = [], content.say
    driven, now = say("today, in the vehicle", "heute, im Fahrzeug"), say("today", "heute")
    nominal, band = say("nominal", "Nennwert"), say("band", "Band")
    torque = say("over wheel torque [N m]", "über Radmoment [N m]")
    for asked in content.specification.directions:
        state = content.states.get(asked.name)
        if state is None or asked.today_n_per_mm is None or not state.points[0].size:
            continue
        if not np.all(np.isfinite(state.points[0])):  # a run without engine torque has no preload
            continue
        backed = np.isfinite(state.curve[1])
        order = np.argsort(state.curve[0][backed], kind="stable")
        x, today = (values[backed][order] for values in state.curve)
        today, curves, ranges = N_PER_MM * today, {}, {}
        if x.size:
            curves[now] = today
            if asked.lower is not None and asked.upper is not None:
                curves[nominal] = 0.5 * (asked.lower + asked.upper) * today
                ranges[band] = (asked.lower * today, asked.upper * today)
        panels.append(
            plot.CurvePanel(
                asked.name if state.over_force else f"{asked.name}, {torque}",
                x if x.size else state.points[0],
                curves,
                {driven: (state.points[0], N_PER_MM * state.points[1])},
                ranges,
                note=content.duty(asked),
            )
        )
    if not panels:
        return
    colour = mount_colours([m.name for m in content.study.platform.mounts])[content.mount.name]
    page.figure(
        plot.curve_panels(
            panels,
            x_label=say("static force [N]", "statische Kraft [N]"),
            y_label=say("dynamic stiffness |K| [N/mm]", "|K|, dynamisch [N/mm]"),
            dashed=(now,),
            colours={driven: MUTED, now: INK, nominal: colour, band: colour},
        ),
        content.say(
            "Dots: today's part in the vehicle, torque only. Curves: today's part and the band at "
            "amplitude and frequency of the test, where measurements back them.",
            "Punkte: heutiges Teil im Fahrzeug, nur Drehmoment. Kurven: heutiges Teil und Band bei "
            "Amplitude und Frequenz der Prüfung, soweit gemessen.",
        ),
    )


STEM = "supplier_sheet"
NOTHING = SheetFiles()


@dataclass(frozen=True)
class WrittenSheets:
    """Files that were written, and fields of the programme that nobody has given."""

    files: tuple[Path, ...]
    missing: tuple[str, ...]


def written_sheets(
    entry: RunEntry, out: Path | None, contents: Mapping[str, bytes], missing: tuple[str, ...]
) -> WrittenSheets:
    """Write the files of a sheet; one that was issued is not overwritten."""
    place = path_inside(entry.folder, "supplier") if out is None else out
    refuse_all(
        f"{path_inside(place, name)} is there, and a sheet that was issued is not overwritten: "
        "give another folder with --out, and the sheet that it follows with --since"
        for name in contents
        if path_inside(place, name).exists()
    )
    place = made_folder(place)
    for name, data in contents.items():
        replace_bytes(path_inside(place, name), data)
    return WrittenSheets(tuple(place / name for name in contents), missing)


def middle_design(
    study: SupplierStudy, found: Mapping[str, tuple[float, float] | None]
) -> RealArray:
    """Return the design in the middle of all bands, today's where there is none, (k,) [1]."""
    design = np.array(study.wanted)
    for direction in study.directions:
        band = found[direction.name]
        design[direction.column] = 1.0 if band is None else 0.5 * sum(band)
    return design


def documents(content: MountSheet, provenance: str) -> tuple[str, bytes]:
    """Return page and workbook of a sheet, searched for what they must not tell."""
    secrets = content.secrets
    tables = {f"table {name}": table.to_csv() for name, table in content.tables.items()}
    refuse_leaks(secrets, tables)  # before anything is drawn: pictures cannot be searched
    html = sheet_page(content, provenance).html()
    title = content.say(f"Mount {content.mount.name}", f"Lager {content.mount.name}")
    workbook = workbook_bytes(content.tables, title)
    refuse_leaks(secrets, {"page": page_text(html), "workbook": workbook_text(workbook)})
    return html, workbook


def provenance(content: MountSheet, files: SheetFiles) -> str:
    """Return date, run and command for the foot of a page; an anonymous one has no command."""
    study = content.study
    today = datetime.now(UTC).date().isoformat()
    text = f" · {today} · deboom, {study.run.entry.name}"
    if content.secrets:
        return text
    given = "".join(f" --{k} {_from_here(v)}" for k, v in vars(files).items() if v is not None)
    wanted = _from_here(study.pick) if isinstance(study.pick, Path) else study.pick.value
    design = "" if study.pick is Pick.best_mean else f" --design {wanted}"
    words = f"--supplier --mount {content.mount.name} --language {content.language.value}"
    return f"{text} · deboom report {_from_here(study.run.entry.folder)} {words}{design}{given}"


def _from_here(path: Path) -> str:
    """Return a path from the working folder, or its last part: a supplier reads no other folder."""
    whole, here = path.resolve(), Path.cwd().resolve()
    return whole.relative_to(here).as_posix() if whole.is_relative_to(here) else whole.name
