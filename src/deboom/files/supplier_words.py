"""Words of a supplier's sheet in English and German: columns by stable keys, cells, reasons.

Tables carry keys while they are computed; what a reader sees, and what a returned workbook is read
by, comes from here.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import pandas as pd

from deboom.errors import InputError
from deboom.language import Language


@dataclass(frozen=True)
class Word:
    """A word in both languages.

    Parameters
    ----------
    en, de : str
        The word; in a sentence, ``{name}`` stands for what is put in.
    unit : str
        Of a column or field; empty for words.
    decimals : int or None
        That a page shows; None: as the unit deserves.
    """

    en: str
    de: str
    unit: str = ""
    decimals: int | None = None


N_MM, PER_CENT, NEWTON, MM, HZ, NUMBER, DB = "N/mm", "%", "N", "mm", "Hz", "1", "dB"
MILLI_DB = "0.001 dB"

WORDS: Mapping[str, Word] = {
    # what is demanded of a direction, and the state where it holds
    "direction": Word("direction", "Richtung"),
    "duty": Word("class", "Klasse"),
    "nominal_share": Word("new, of today's", "neu, vom heutigen", PER_CENT, 1),
    "lower_share": Word("from, of today's", "von, vom heutigen", PER_CENT, 1),
    "upper_share": Word("to, of today's", "bis, vom heutigen", PER_CENT, 1),
    "half_width": Word("±", "±", PER_CENT, 1),
    "loss_factor": Word("loss factor", "Verlustfaktor", NUMBER, 3),
    "set_by_limit": Word("set by the noise limit", "durch Geräuschgrenzwert"),
    "saving": Word("saving", "Ersparnis"),
    "preload_n": Word("preload", "Vorlast", NEWTON, 0),
    "preload_mm": Word("deflection", "Einfederung", MM, 2),
    "amplitude_mm": Word("amplitude, peak", "Amplitude, Spitze", MM, 3),
    "frequency_hz": Word("frequency", "Frequenz", HZ, 1),
    "nominal": Word("new |K|", "|K| neu", N_MM),
    "lower": Word("accepted from", "zulässig von", N_MM),
    "upper": Word("accepted to", "zulässig bis", N_MM),
    "static_rate": Word("static rate", "statische Rate", N_MM),
    "today": Word("today |K|", "heute |K|", N_MM),
    "today_half_width": Word("today ± 95 %", "heute ± 95 %", PER_CENT, 1),
    # the test of a part
    "test_lower": Word("accepted |K| from", "zulässig |K| von", N_MM, 1),
    "test_upper": Word("accepted |K| to", "zulässig |K| bis", N_MM, 1),
    "guarded_lower": Word("guarded from", "eingeengt von", N_MM, 1),
    "guarded_upper": Word("guarded to", "eingeengt bis", N_MM, 1),
    "nominal_real": Word("new K'", "K' neu", N_MM, 1),
    "nominal_imaginary": Word("new K''", "K'' neu", N_MM, 1),
    "loss_angle": Word("loss angle", "Verlustwinkel", "°"),
    "decides": Word("decides", "entscheidet"),
    # the table that comes back filled in
    "part": Word("part", "Teil"),
    "batch": Word("batch", "Charge"),
    "part_number": Word("part number", "Teilenummer"),
    "measured_preload": Word("preload", "Vorlast", NEWTON),
    "measured_amplitude": Word("amplitude", "Amplitude", MM),
    "measured_frequency": Word("frequency", "Frequenz", HZ),
    "magnitude": Word("|K|", "|K|", N_MM),
    "real": Word("K'", "K'", N_MM),
    "imaginary": Word("K''", "K''", N_MM),
    # the process
    "demanded_by": Word("asked by", "gefordert von"),
    "cpk": Word("Cpk at least", "Cpk mindestens", NUMBER, 2),
    "sigma": Word("σ in the middle at most", "σ in der Mitte höchstens", N_MM),
    "sigma_share": Word("σ at most", "σ höchstens", PER_CENT, 2),
    "sample_size": Word("measured parts", "gemessene Teile"),
    "sample_cpk": Word("Cpk of the sample at least", "nötiger Cpk der Stichprobe", NUMBER, 2),
    "process_cpk": Word("Cpk of the process", "Cpk des Prozesses", NUMBER, 2),
    "proving_parts": Word("parts that prove it then", "Teile für den Nachweis dann"),
    # what it is worth
    "slope": Word("level, 10 % stiffer", "Pegel, 10 % steifer", DB, 2),
    "slope_percent": Word("level, 1 % stiffer", "Pegel, 1 % steifer", DB, 3),
    "slope_tolerance": Word(
        "level, upper end of tolerance", "Pegel, oberes Ende der Toleranz", DB, 2
    ),
    "slope_half_width": Word("± 90 %", "± 90 %", DB, 2),
    "gain": Word("scatter σ saved per 1 % tolerance", "Streuung σ je 1 % Toleranz", MILLI_DB, 1),
    "gain_half_width": Word("± 90 % of it", "± 90 % davon", MILLI_DB, 1),
    "first": Word("share of the variance, alone", "Anteil der Varianz, allein", PER_CENT, 1),
    "total": Word("with others", "mit anderen", PER_CENT, 1),
    "total_half_width": Word("± 95 %", "± 95 %", PER_CENT, 1),
    "sigma_part": Word("share of the scatter", "Anteil der Streuung", PER_CENT, 1),
    "design": Word("design", "Entwurf"),
    "level": Word("mean level", "mittlerer Pegel", "dB(A)", 1),
    "expected_change": Word("expected", "erwartet", DB, 1),
    "expected_low": Word("from, 90 %", "von, 90 %", DB, 1),
    "expected_high": Word("to, 90 %", "bis, 90 %", DB, 1),
    "change": Word("change, model", "Änderung, Modell", DB, 2),
    "change_half_width": Word("± 90 %", "± 90 %", DB, 2),
    "other_model": Word("second model", "zweites Modell", DB, 2),
    # part numbers, fields, what it rests on, what moved, curves
    "vehicles": Word("vehicles", "Fahrzeuge"),
    "stated": Word("of today's, |K|", "vom heutigen, |K|"),
    "inside": Word("inside the band", "im Band"),
    "field": Word("field", "Feld"),
    "value": Word("value", "Wert"),
    "item": Word("item", "Angabe"),
    "was": Word("was", "vorher"),
    "curve": Word("curve", "Kennlinie"),
    "abscissa": Word("over", "über"),
    "unit": Word("unit", "Einheit"),
    "ordinate_unit": Word("unit of the values", "Einheit der Werte"),
    "curve_today": Word("today", "heute"),
    "curve_lower": Word("from", "von"),
    "curve_upper": Word("to", "bis"),
    # importance without a design
    "vehicle": Word("vehicle", "Fahrzeug"),
    "share_alone": Word("share, alone", "Anteil, allein", PER_CENT, 1),
    "share_total": Word("share, with others", "Anteil, mit anderen", PER_CENT, 1),
    "share_half_width": Word("± 95 %", "± 95 %", PER_CENT, 1),
    "most_in": Word("most in", "am meisten in"),
    "share_there": Word("share there", "Anteil dort", PER_CENT, 1),
    # verdicts
    "passed": Word("pass", "bestanden"),
    "failed": Word("fail", "nicht bestanden"),
    "undecided": Word("undecided", "unentschieden"),
    "parts": Word("parts", "Teile"),
    "verdict": Word("verdict", "Urteil"),
    "inside_at_least": Word("pieces inside at least", "innen mindestens", PER_CENT, 1),
    "reason": Word("reason", "Grund"),
    "axis": Word("direction", "Richtung"),
    "rule": Word("rule", "Regel"),
    "from_ratio": Word("from, over today's", "von, über heute", NUMBER),
    "to_ratio": Word("to, over today's", "bis, über heute", NUMBER),
    "mean_ratio": Word("mean, over today's", "Mittel, über heute", NUMBER),
    "sigma_of_mean": Word("σ", "σ", PER_CENT, 1),
    "cp": Word("Cp", "Cp", NUMBER, 2),
    "cp_bound": Word("Cp at least", "Cp mindestens", NUMBER, 2),
    "cpk_measured": Word("Cpk", "Cpk", NUMBER, 2),
    "cpk_bound": Word("Cpk at least", "Cpk mindestens", NUMBER, 2),
    "cpk_demanded": Word("Cpk asked for", "Cpk gefordert", NUMBER, 2),
    "cpk_verdict": Word("capability", "Fähigkeit"),
    # fields of the head
    "drawing": Word("drawing", "Zeichnung"),
    "revision": Word("revision", "Änderungsstand"),
    "state": Word("state", "Status"),
    "issued": Word("issued", "ausgestellt"),
    "checksum": Word("sheet, checksum", "Blatt, Prüfsumme"),
    "pieces": Word("pieces per vehicle", "Stück je Fahrzeug"),
    "parts_per_year": Word("parts per year", "Teile je Jahr"),
    "variants": Word("variants, vehicles per year", "Varianten, Fahrzeuge je Jahr"),
    "contact": Word("contact", "Ansprechpartner"),
    "prototypes": Word("prototypes", "Prototypen"),
    "start_of_production": Word("start of production", "Serienanlauf"),
    "temperature": Word("temperature", "Temperatur", "°C"),
    "cycles": Word("conditioning cycles", "Vorkonditionierung, Zyklen"),
    "conditioned": Word("conditioned up to x, y, z", "vorkonditioniert bis x, y, z", NEWTON),
    "further": Word("further frequencies", "weitere Frequenzen", HZ),
    "second_amplitude": Word("second amplitude, peak", "zweite Amplitude, Spitze", "mm"),
    "loss_tolerance": Word("tolerance of the loss factor", "Toleranz des Verlustfaktors"),
    "rate_tolerance": Word("tolerance of the static rate", "Toleranz der statischen Rate"),
    "ageing": Word("ageing and relaxation", "Alterung und Relaxation"),
    "fixture": Word("fixture", "Aufnahme"),
    "sampling": Word("sampling", "Stichprobe"),
    "first_articles": Word("first articles", "Erstmuster"),
    "band": Word("band of the noise", "Band des Geräuschs", HZ),
    "load_case": Word("load case", "Lastfall"),
    "wheel_torque": Word("wheel torque", "Radmoment", "N m"),
    "uncertainty": Word("measuring uncertainty, 95 %", "Messunsicherheit, 95 %", PER_CENT),
    "weight": Word("weight force x, y, z", "Gewichtskraft x, y, z", NEWTON),
    "zero": Word("zero of the static curve", "Nullpunkt der statischen Kennlinie"),
    "standard": Word("standard of the test", "Norm der Prüfung"),
    "box_checksum": Word("box, checksum", "Box, Prüfsumme"),
    "judged_on": Word("judged on", "beurteilt am"),
    "measured_parts": Word("measured parts", "gemessene Teile"),
    "stated_uncertainty": Word("measuring uncertainty, 95 %", "Messunsicherheit, 95 %"),
    "stated_share": Word("asked share of the pieces", "geforderter Anteil der Stücke"),
    # names of the sheets of a workbook
    "sheet_block": Word("data block", "Datenblock"),
    "sheet_frequencies": Word("over frequency", "über Frequenz"),
    "sheet_test": Word("test", "Prüfung"),
    "sheet_measured": Word("measured", "gemessen"),
    "sheet_process": Word("process", "Prozess"),
    "sheet_worth": Word("worth", "Nutzen"),
    "sheet_levels": Word("levels", "Pegel"),
    "sheet_programme": Word("programme", "Programm"),
    "sheet_variants": Word("part numbers", "Teilenummern"),
    "sheet_basis": Word("basis", "Grundlage"),
    "sheet_changes": Word("changes", "Änderungen"),
    "sheet_curves": Word("curves", "Kennlinien"),
    "sheet_rules": Word("rules", "Regeln"),
    "sheet_importance": Word("importance", "Bedeutung"),
    "sheet_by_vehicle": Word("by vehicle", "je Fahrzeug"),
    # cells
    "must": Word("must", "Muss"),
    "preferred": Word("preferred", "bevorzugt"),
    "free": Word("free", "frei"),
    "identified": Word("identified", "identifiziert"),
    "not identified": Word("not identified", "nicht identifiziert"),
    "end from": Word("lower end", "unteres Ende"),
    "end to": Word("upper end", "oberes Ende"),
    "end from and to": Word("both ends", "beide Enden"),
    "draft": Word("draft", "Entwurf"),
    "released": Word("released", "freigegeben"),
    "yes": Word("yes", "ja"),
    "no": Word("no", "nein"),
    "cannot decide": Word("no: this test cannot decide", "nein: diese Prüfung kann es nicht"),
    "as a ratio": Word("as a ratio to today's part", "als Verhältnis zum heutigen Teil"),
    "acoustics": Word("acoustics", "Akustik"),
    "usual": Word("usual", "üblich"),
    "design today": Word("today", "heute"),
    "design part": Word("only this part new", "nur dieses Teil neu"),
    "design all": Word("all parts new", "alle Teile neu"),
    "design wanted": Word("wanted design itself", "gewünschter Entwurf selbst"),
    "unloaded": Word("unloaded", "unbelastet"),
    "under weight": Word("under weight", "unter Gewicht"),
    "part today": Word("today", "heute"),
    "dynamic": Word("dynamic |K|", "dynamisch |K|"),
    "static": Word("static force", "statische Kraft"),
    "shown": Word("shown", "gezeigt"),
    "open": Word("open: measure more parts", "offen: mehr Teile messen"),
    "missed": Word("missed", "verfehlt"),
    # reasons
    "outside": Word("outside", "außerhalb"),
    "near": Word("too near to an end", "zu nahe an einem Ende"),
    "undecidable": Word(
        "not decided, the uncertainty exceeds the interval",
        "nicht entschieden, die Unsicherheit ist größer als das Intervall",
    ),
    "part reason": Word(
        "{axis} {what}: {measured}{of}, asked {first} to {last}{unit}",
        "{axis} {what}: {measured}{of}, gefordert {first} bis {last}{unit}",
    ),
    "of today's": Word(" of today's", " des heutigen"),
    "parts outside": Word(
        "{n} of {of} parts are outside; the furthest has {furthest}",
        "{n} von {of} Teilen liegen außen; am weitesten liegt {furthest}",
    ),
    "parts near": Word(
        "{n} parts too near to an end to decide", "{n} Teile zu nah an einem Ende zum Entscheiden"
    ),
    "too few parts": Word(
        "too few measured parts to speak for the others: measure more",
        "zu wenige gemessene Teile, um für die anderen zu sprechen: mehr messen",
    ),
    "not normal": Word(
        "{axes}: the parts contradict the normal law that shares and bounds rest on, as of two "
        "cavities or mixed batches: judge each as a batch of its own",
        "{axes}: die Teile widersprechen der Normalverteilung, auf der Anteile und Schranken "
        "beruhen, wie bei zwei Kavitäten oder gemischten Chargen: jede einzeln beurteilen",
    ),
    "drift": Word(
        "{axis} drifts by {drift} % from batch to batch over {n} batches: Ppk of all parts is "
        "{ppk}, the smallest Cpk of a batch {cpk}; find the cause before the next batch",
        "{axis} läuft um {drift} % von Charge zu Charge über {n} Chargen: Ppk aller Teile ist "
        "{ppk}, der kleinste Cpk einer Charge {cpk}; Ursache vor der nächsten Charge finden",
    ),
    "all batches": Word("all {n} batches (Pp, Ppk)", "alle {n} Chargen (Pp, Ppk)"),
    "corner": Word(
        "too few cars will keep the limit: the batch lies in a corner of the box",
        "zu wenige Fahrzeuge werden den Grenzwert halten: die Charge liegt in einer Ecke der Box",
    ),
}
"""Every label and cell of sheets, workbooks and verdicts by its key."""


def said(key: str, language: Language, **given: object) -> str:
    """Return a word in a language, with what is put in.

    Raises
    ------
    InputError
        The table has no such key.
    """
    if key not in WORDS:
        raise InputError(f"the table of a sheet's words has no '{key}'")
    text = language.say(WORDS[key].en, WORDS[key].de)
    return text.format(**given) if given else text


def label(key: str, language: Language, unit: str | None = None) -> str:
    """Return the label of a column, ``name [unit]``.

    - `unit`: where the column has another one than its own, such as a currency.
    """
    unit = WORDS[key].unit if unit is None and key in WORDS else unit
    shown = language.local(unit or "")
    return said(key, language) + (f" [{shown}]" if shown else "")


def labelled(
    table: pd.DataFrame, language: Language, units: Mapping[str, str] | None = None
) -> pd.DataFrame:
    """Return a table with the labels of a language in place of its keys.

    - `units`: of columns that have another one than their own, by key.
    - raises InputError: a column that is no key.
    """
    units = units or {}
    return table.set_axis([label(str(k), language, units.get(str(k))) for k in table], axis=1)


def decimals_of(
    table: pd.DataFrame, language: Language, units: Mapping[str, str] | None = None
) -> dict[str, int]:
    """Return the decimals of the columns of a keyed table that have some, by label."""
    units = units or {}
    return {
        label(str(key), language, units.get(str(key))): digits
        for key in table
        if (digits := WORDS[str(key)].decimals) is not None
        and pd.api.types.is_numeric_dtype(table[key])
        and table[key].notna().any()
    }
