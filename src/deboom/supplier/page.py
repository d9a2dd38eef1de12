"""Page and workbook of every document that a supplier gets: written, searched for leaks, kept."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import pandas as pd

from deboom import plot
from deboom.explore.choices import Pick
from deboom.files.disk import made_folder, replace_bytes
from deboom.files.run_folder import RunEntry
from deboom.files.schema import refuse_all
from deboom.files.supplier_words import decimals_of, label, labelled
from deboom.files.tables import workbook_bytes
from deboom.names import path_inside
from deboom.report.sheet import Sheet
from deboom.supplier.sheet import AT_STATE, RATIO, SHORT_HASH, PartSheet
from deboom.supplier.sources import SheetFiles, page_text, refuse_leaks, workbook_text

TEST_ENDS = (
    "direction",
    "preload_n",
    "amplitude_mm",
    "frequency_hz",
    "test_lower",
    "test_upper",
    "guarded_lower",
    "guarded_upper",
)
NAMES = ("part_number", "drawing", "revision")
"""Fields of the head that stand there also while nobody has stated them; others share a line."""
CONDITIONS = ("ageing", "fixture", "sampling", "first_articles")
"""Fields in words: they stand below the others."""
COLUMNS = (3, 5)
"""Panels in a row: the fewest with which two rows have room for all."""
ROW_HEIGHT = 1.25
"""Of a row of panels, so that two fit on the first page [inch]."""


def show(
    page: Sheet,
    table: pd.DataFrame,
    columns: Sequence[str] = (),
    *,
    caption: str = "",
    units: Mapping[str, str] | None = None,
    before: Mapping[tuple[int, str], str] | None = None,
) -> None:
    """Show a keyed table with the labels of the page's language; columns without a value go.

    - `columns`: keys of those that are shown; default: all. `units`: see `labelled`.
    - `before`: by row and key, see `Sheet.table`.
    """
    shown = table[[key for key in (columns or table.columns) if key in table]]
    shown = shown.dropna(axis=1, how="all")
    moved = {
        (row, label(key, page.language, (units or {}).get(key))): was
        for (row, key), was in (before or {}).items()
        if key in shown
    }
    digits = decimals_of(shown, page.language, units)
    page.table(labelled(shown, page.language, units), caption, digits, moved)


def sheet_page(content: PartSheet, foot: str) -> Sheet:
    """Write the two pages of a part's sheet; `foot` is where it comes from."""
    say, units = content.language.say, content.units
    page = Sheet(content.title, content.description, content.language)
    head = content.head
    due = [key for key, value in head.items() if not value and key not in NAMES]
    elsewhere = (*due, *CONDITIONS)
    page.fields({content.label(key): v for key, v in head.items() if key not in elsewhere})
    stated = [f"{content.label(key)}: {head[key]}." for key in CONDITIONS if head[key]]
    page.text(" ".join(text[0].upper() + text[1:] for text in stated))
    if due:
        page.text(
            say("To be agreed: ", "Noch zu vereinbaren: ")
            + f"{'; '.join(content.word(key) for key in due)}."
        )
    page.section(say("Data block", "Datenblock"))
    curves = content.curves
    show(page, content.block, RATIO, units=units, before=content.changes)
    show(
        page,
        content.block,
        AT_STATE,
        caption=say(
            "The same in N/mm, at this state alone; means in the vehicle differ. As a share of "
            "today's part the band holds at every preload, amplitude and frequency.",
            "Dasselbe in N/mm, nur bei diesem Zustand; Mittelwerte im Fahrzeug sind andere. Als "
            "Anteil des heutigen Teils gilt das Band bei jeder Vorlast, Amplitude und Frequenz.",
        ),
        before=content.changes,
    )
    page.figure(
        plot.axes_sketch(curves.axes, curves.along),
        curves.axes_caption,
        aside=True,
    )
    for text in (content.classes, *content.notes):
        page.text(text)
    if content.changes:
        old = content.since
        assert old is not None
        page.text(
            say("Marked cells moved since sheet ", "Markierte Zellen sind anders als auf Blatt ")
            + f"{old.checksum[:SHORT_HASH]}"
            + (f" ({old.revision})." if old.revision else ".")
        )
    _figures(page, content)

    page.new_page()
    page.section(say("Test of a part", "Prüfung eines Teils"), _test_words(content))
    if len(content.test):
        show(page, content.test, TEST_ENDS if _all_decide(content) else (*TEST_ENDS, "decides"))
    _frequencies(page, content)
    if content.rules:
        page.section(say("How a delivery is judged", "Wie eine Lieferung beurteilt wird"))
        page.rules(content.rules)
    if len(content.process):
        page.section(say("What the process must show", "Nachweis der Prozessfähigkeit"))
        show(page, content.process)
    if content.decibels:
        page.section(say("What it is worth", "Nutzen im Innenraum"), content.worth_words)
        if len(content.worth):
            show(page, content.worth)
        show(page, content.levels)
    if len(content.variants):
        page.section(say("Part numbers", "Teilenummern"))
        show(page, content.variants)
    page.section(say("Words", "Begriffe"))
    page.text(
        say(
            "|K|: magnitude of the complex dynamic stiffness K = K' + jK'' of a piece, force over "
            "displacement; loss factor K''/K'. Amplitudes are peak. σ: standard deviation of a "
            "process in the middle of its band. Cpk: distance of the mean from the nearer end of "
            "the band over 3 σ [1].",
            "|K|: Betrag der komplexen dynamischen Steifigkeit K = K' + jK'' eines Stücks, Kraft "
            "durch Weg; Verlustfaktor K''/K'. Amplituden sind Spitzenwerte. σ: Standardabweichung "
            "eines Prozesses in der Mitte seines Bandes. Cpk: Abstand des Mittelwerts vom näheren "
            "Ende des Bandes durch 3 σ [1].",
        )
        + "".join(f" {text}" for text in content.glossary)
    )
    page.signatures(
        say("Customer: date, signature", "Kunde: Datum, Unterschrift"),
        say("Supplier: date, signature", "Lieferant: Datum, Unterschrift"),
    )
    page.foot = say("Sheet ", "Blatt ") + content.specification.checksum[:SHORT_HASH] + foot
    return page


def _all_decide(content: PartSheet) -> bool:
    """Tell whether every line of the test decides in N/mm."""
    return set(content.test["decides"]) == {content.word("yes")}


def _test_words(content: PartSheet) -> str:
    """Say how a part is tested, by which standard."""
    say = content.language.say
    standard = say(
        "Dynamic transfer stiffness by ISO 10846-2 (direct method): the body side is held on a "
        "force transducer, the other side is moved under preload. Force and displacement of the "
        "moved side are enough where ISO 10846-5 (driving point) applies: inertia is negligible "
        "or subtracted. ",
        "Dynamische Transfersteifigkeit nach ISO 10846-2 (direktes Verfahren): die Karosserieseite "
        "auf einem Kraftaufnehmer gehalten, die andere unter Vorlast bewegt. Kraft und Weg der "
        "bewegten Seite genügen, wo ISO 10846-5 (Eingangspunkt) gilt: Trägheit vernachlässigbar "
        "oder abgezogen. ",
    )
    if not content.specification.musts:
        standard += say(
            "No direction of this part is a must; no limit applies. ",
            "Keine Richtung dieses Teils ist ein Muss; kein Grenzwert gilt. ",
        )
    loaded = any(d.preload_n for d in content.tested)
    raised = say(
        "Raise the preload, a force, from zero without overshoot, as the torque rises in the "
        "vehicle; otherwise the rubber measures stiffer. Preloads of all directions act together "
        "in the vehicle. ",
        "Vorlast als Kraft von null aus ohne Überschwingen steigern, wie das Drehmoment im "
        "Fahrzeug; sonst misst sich der Gummi steifer. Im Fahrzeug wirken die Vorlasten aller "
        "Richtungen zusammen. ",
    )
    test = content.agreed.test
    stated = (
        (test.loss_factor_tolerance, say("loss factor", "Verlustfaktor")),
        (test.static_rate_tolerance, say("static rate", "statische Rate")),
    )
    tolerances = say(" and ", " und ").join(
        f"{name} ± {content.percent(share)}" for share, name in stated if share is not None
    )
    reported = tolerances and say(
        f"Agreed tolerances that are reported and not judged: {tolerances}. ",
        f"Vereinbarte Toleranzen, die berichtet und nicht beurteilt werden: {tolerances}. ",
    )
    guarded = (
        say(
            "Guarded limits follow once a measuring uncertainty is stated. ",
            "Eingeengte Grenzen folgen, sobald eine Messunsicherheit genannt ist. ",
        )
        if content.specification.uncertainty is None
        else say(
            "Inside the guarded limits a part passes for sure. ",
            "In den eingeengten Grenzen besteht ein Teil sicher. ",
        )
    )
    return (
        standard
        + (raised if loaded else "")
        + reported
        + guarded
        + say(
            "Fill in the sheet “measured” of the workbook: |K| and the loss angle, or K' and K'', "
            "of each piece. Measure a part of today as well (rows “today”) if the machine sets "
            "only one preload, or if the interval of today's |K| is too wide.",
            "Blatt „gemessen“ der Arbeitsmappe ausfüllen: |K| und Verlustwinkel oder K' und K'' je "
            "Stück. Stellt die Maschine nur eine Vorlast ein, oder ist der Bereich des heutigen "
            "|K| zu breit, auch ein heutiges Teil messen (Zeilen „heute“).",
        )
    )


def _frequencies(page: Sheet, content: PartSheet) -> None:
    """Show the new part over frequency: a row per direction and amplitude."""
    say, table = content.language.say, content.over_frequency
    if table.empty:
        page.text(
            say(
                "Stiffness over frequency at the state of a test was not measured: further "
                "frequencies and a second amplitude are to be agreed.",
                "Die Steifigkeit über der Frequenz im Zustand einer Prüfung wurde nicht gemessen: "
                "weitere Frequenzen und eine zweite Amplitude sind noch zu vereinbaren.",
            )
        )
        return
    shown = table[["direction", "amplitude_mm"]].drop_duplicates()
    wide = labelled(shown, page.language).reset_index(drop=True)
    digits = decimals_of(shown, page.language)
    empty = []
    for key, name, unit, decimals in (("nominal", "|K|", "N/mm", 0), ("loss_factor", "η", "1", 2)):
        for line, rows in table.groupby("frequency_hz"):
            if rows["nominal"].isna().all():
                empty.append(page.local(f"{line:g} Hz"))
                continue
            column = page.local(f"{name} {line:g} Hz [{unit}]")
            wide[column] = rows[key].to_numpy()
            digits[column] = decimals
    unmeasured = "; ".join(dict.fromkeys(["–", *empty]))
    page.table(
        wide,
        say(
            "|K| and loss factor η of the new part over frequency, at the preload of the test; ± "
            f"of the data block holds at each. {unmeasured}: nothing was measured, nothing is "
            "asked. A delivery is judged at its state of the test alone.",
            "|K| und Verlustfaktor η des neuen Teils über der Frequenz, bei der Vorlast der "
            f"Prüfung; ± des Datenblocks gilt bei jeder. {unmeasured}: nichts gemessen, nichts "
            "gefordert. Beurteilt wird eine Lieferung nur im Zustand der Prüfung.",
        ),
        digits,
    )


def _figures(page: Sheet, content: PartSheet) -> None:
    """Show dynamic stiffness over force and frequency, and the static force over deflection."""
    curves = content.curves
    if not curves.panels:
        return
    page.figure(
        plot.curve_panels(
            curves.panels,
            columns=next(c for c in COLUMNS if len(curves.panels) <= 2 * c or c == COLUMNS[-1]),
            dashed=curves.dashed,
            colours=curves.colours,
            panel_height=ROW_HEIGHT,
        ),
        curves.caption,
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
    place = entry.writable("supplier") if out is None else out
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


def searched_documents(
    secrets: tuple[str, ...],
    tables: Mapping[str, pd.DataFrame],
    title: str,
    draw: Callable[[], Sheet],
) -> tuple[str, bytes]:
    """Return page and workbook of a supplier's document, searched for what they must not tell.

    - `tables`: of the workbook, with labels; they are searched before anything is drawn, since
      pictures cannot be. `draw`: writes the page.
    - raises InputError: a secret is left; see `refuse_leaks`.
    """
    refuse_leaks(secrets, {f"table {name}": table.to_csv() for name, table in tables.items()})
    html, workbook = draw().html(), workbook_bytes(tables, title)
    refuse_leaks(secrets, {"page": page_text(html), "workbook": workbook_text(workbook)})
    return html, workbook


def documents(content: PartSheet, foot: str) -> tuple[str, bytes]:
    """Return page and workbook of a part's sheet, searched for what they must not tell."""
    title = content.language.say(f"Mount {content.part}", f"Lager {content.part}")
    return searched_documents(
        content.secrets, content.tables, title, partial(sheet_page, content, foot)
    )


def provenance(
    entry: RunEntry, content: PartSheet, files: SheetFiles, pick: Pick | Path = Pick.best_mean
) -> str:
    """Return day, run and command for the foot of a page; an anonymous one names neither."""
    text = f" · {content.issued} · deboom"
    if content.secrets:
        return text
    given = "".join(f" --{k} {_from_here(v)}" for k, v in vars(files).items() if v is not None)
    wanted = _from_here(pick) if isinstance(pick, Path) else pick.value
    design = "" if pick is Pick.best_mean else f" --design {wanted}"
    words = f"--supplier --mount {content.part} --language {content.language}"
    return f"{text}, {entry.name} · deboom report {_from_here(entry.folder)} {words}{design}{given}"


def _from_here(path: Path) -> str:
    """Return a path from the working folder, or its last part: a supplier reads no other folder."""
    whole, here = path.resolve(), Path.cwd().resolve()
    return whole.relative_to(here).as_posix() if whole.is_relative_to(here) else whole.name
