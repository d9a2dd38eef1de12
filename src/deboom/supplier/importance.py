"""What a mount supplier learns from a sensitivity study alone: the importance of each direction."""

from __future__ import annotations

import string
from dataclasses import dataclass
from functools import cached_property, partial

import numpy as np
import pandas as pd

from deboom import plot
from deboom.arrays import AXES, PERCENT
from deboom.errors import InputError
from deboom.files.acceptance import Programme, read_programme
from deboom.files.run_folder import RunEntry
from deboom.files.supplier_words import label, labelled, said
from deboom.files.tables import read_frame
from deboom.language import Language
from deboom.measurement.channels import LoadCase
from deboom.mounts.mount import Mount
from deboom.pages.front import drawn_rows
from deboom.pages.sensitivity import NEGLIGIBLE, SLOPE, Analysis
from deboom.physics.dynamic_stiffness import N_PER_MM
from deboom.report.sheet import Sheet
from deboom.supplier.page import searched_documents, show
from deboom.supplier.sources import platform_secrets
from deboom.vehicles.platform import Runs

INDICES, FRONT = "sobol.csv", "front.csv"
FIRST, TOTAL, INTERVAL = "first order [1]", "total [1]", "total interval ± [1]"


def is_sensitivity(entry: RunEntry) -> bool:
    """Say whether a run has sensitivities and no front."""
    files = entry.record.get("files_sha256", {})
    return INDICES in files and FRONT not in files


@dataclass(frozen=True, eq=False)
class ImportanceSheet:
    """Importance of the directions of one mount, in the language of a supplier.

    Parameters
    ----------
    mount : Mount
    indices : DataFrame
        ``sobol.csv`` of the run: a row per vehicle and variable.
    runs : Runs
        Platform, load cases and band of the run.
    programme : Programme
        Beside the platform.
    varied : Analysis
        What the stiffnesses did.
    width : float
        Half width of their range, or of their scatter: three standard deviations [1].
    tolerance : float
        Half width within which parts are made [1].
    language : Language
    secrets : tuple of str
        Names and paths that an anonymous sheet may not hold; empty if it is not anonymous.
    issued : str
        Day, YYYY-MM-DD.
    decibels : bool
        Whether it says how the level changes.
    """

    mount: Mount
    indices: pd.DataFrame
    runs: Runs
    programme: Programme
    varied: Analysis
    width: float
    tolerance: float
    language: Language
    secrets: tuple[str, ...]
    issued: str
    decibels: bool

    @cached_property
    def vehicles(self) -> dict[str, str]:
        """Name of each vehicle on the sheet; letters where it is anonymous."""
        names = list(dict.fromkeys(self.indices["vehicle"]))
        if not self.secrets:
            return {name: name for name in names}
        word = self.language.say("vehicle", "Fahrzeug")
        return {name: f"{word} {_letters(number)}" for number, name in enumerate(names)}

    @cached_property
    def by_vehicle(self) -> pd.DataFrame:
        """One row per direction and vehicle, by keys: shares with interval, and dB per 10 %.

        Where a direction is not identified, its numbers are nan: they would be those of a guess.
        """
        rows = self.indices[self.indices["variable"].isin(self.mount.variables)]
        table = pd.DataFrame(
            {
                "direction": rows["variable"],
                "vehicle": rows["vehicle"].map(self.vehicles),
                "share_alone": PERCENT * rows[FIRST].clip(lower=0.0),
                "share_total": PERCENT * rows[TOTAL],
                "share_half_width": PERCENT * rows[INTERVAL],
                "slope": rows[SLOPE],
            }
        ).reset_index(drop=True)
        table.loc[table["direction"].map(self._unknown), list(table)[2:]] = np.nan
        return table if self.decibels else table.drop(columns="slope")

    @cached_property
    def summary(self) -> pd.DataFrame:
        """One row per direction: mean over the vehicles, and the vehicle that hears it most."""
        grouped = self.by_vehicle.groupby("direction", sort=False)
        table = grouped[list(self.by_vehicle)[2:]].mean().drop(columns="share_half_width")
        if self.decibels:
            table["slope_percent"] = table["slope"] / 10.0
            table["slope_tolerance"] = table["slope"] * 10.0 * self.tolerance
        largest = self.by_vehicle.sort_values("share_total", ascending=False, kind="stable")
        strongest = largest.dropna(subset="share_total").groupby("direction").first()
        table["most_in"] = strongest["vehicle"]
        table["share_there"] = strongest["share_total"]
        table = table.reset_index()
        table.insert(1, "amplitude_mm", table["direction"].map(self._amplitude))
        table.insert(1, "today", table["direction"].map(self._today))
        table.insert(1, "duty", [self._class(name) for name in table["direction"]])
        return table

    @cached_property
    def _today(self) -> dict[str, float]:
        """Mean |K| today of each direction in operation, in the band [N/mm]."""
        names = [name for mount in self.runs.platform.mounts for name in mount.variables]
        first, _ = self.runs.cases[0]
        stiffness = self.runs.stiffness(first, self.runs.band) * N_PER_MM
        pairs = zip(names, stiffness, strict=True)
        return {name: float(value) for name, value in pairs if not self._unknown(name)}

    @cached_property
    def _amplitude(self) -> dict[str, float]:
        """Mean amplitude of each direction in operation, in the band; mean of pieces [mm peak]."""
        case, low, high = self._state
        lines = case.displacement.frequency
        inside = (lines >= low) & (lines <= high)
        amplitudes = {}
        for name, axis in zip(self.mount.variables, AXES, strict=True):
            channels = self.mount.channels(axis)
            if set(channels) <= set(case.displacement.channels):
                moved = case.displacement.select(channels).values[inside]
                amplitudes[name] = 1e3 * float(np.abs(moved).mean())
        return amplitudes

    @property
    def _state(self) -> tuple[LoadCase, float, float]:
        """First load case, and ends of the band [Hz]: where |K| holds."""
        return self.runs.cases[0][0], *self.runs.band

    def _unknown(self, variable: str) -> bool:
        mount, _, axis = variable.rpartition(" ")
        return axis in AXES and bool(self.runs.parts) and not self.runs.identified(mount, axis)

    def _class(self, variable: str) -> str:
        """Say whether a direction is identified: a small share of an unknown one says little."""
        return said("not identified" if self._unknown(variable) else "identified", self.language)

    @property
    def head(self) -> dict[str, str]:
        """Fields of the head by keys: the part, and at what its stiffness holds."""
        number = self.programme.mount(self.mount.name)
        case, low, high = self._state
        lines = case.displacement.frequency
        torque = ""
        if case.engine_torque is not None:
            of_band = case.wheel_torque[(lines >= low) & (lines <= high)]
            torque = f"{of_band.min():.0f}–{of_band.max():.0f}"
        return {
            "part_number": number.part_number or "",
            "drawing": number.drawing_number or "",
            "revision": number.revision or "",
            "contact": self.programme.contact or "",
            "load_case": case.name if self.secrets else case.title,
            "band": f"{low:g}–{high:g}",
            "wheel_torque": torque,
            "issued": self.issued,
        }

    @property
    def tables(self) -> dict[str, pd.DataFrame]:
        """Sheets of the workbook, with labels."""
        language = self.language
        keyed = {"sheet_importance": self.summary, "sheet_by_vehicle": self.by_vehicle}
        return {said(n, language): labelled(table, language) for n, table in keyed.items()}

    def page(self, foot: str) -> Sheet:
        """Write the page; `foot` is where it comes from."""
        say, name = self.language.say, self.mount.name
        page = Sheet(
            say(f"Mount {name}: which directions matter", f"Lager {name}: welche Richtung zählt"),
            say(self.mount.description, self.mount.description_de or self.mount.description),
            self.language,
        )
        page.fields({label(key, self.language): value for key, value in self.head.items()})
        page.section(
            say("Importance of each direction", "Bedeutung jeder Richtung"),
            say(
                "Share of the variance of the booming level at the driver's ear that the dynamic "
                "stiffness of a direction is behind: alone, and with all that it does with "
                "others (Sobol indices, first order and total), means over the vehicles. A "
                "direction with a small share needs no precision for booming; one with a large "
                "share does. ",
                "Anteil an der Varianz des Brummpegels am Fahrerohr, hinter dem die dynamische "
                "Steifigkeit einer Richtung steht: allein, und mit allem, was sie zusammen mit "
                "anderen tut (Sobol-Indizes, erster Ordnung und total), Mittel über die Fahrzeuge. "
                "Eine Richtung mit kleinem Anteil braucht für das Brummen keine Genauigkeit, eine "
                "mit großem schon. ",
            )
            + self._variation()
            + say(
                " |K| and amplitude (peak) are today's, means in operation over load case and band "
                "of the head. Where a direction is not identified, its stiffness is not known well "
                "enough to state a share: that is no leave to do without precision.",
                " |K| und Amplitude (Spitze) sind die heutigen, im Betrieb gemittelt über Lastfall "
                "und Band im Kopf. Wo eine Richtung nicht identifiziert ist, ist ihre Steifigkeit "
                "zu unsicher für einen Anteil; das heißt nicht, dass sie keine Genauigkeit "
                "braucht.",
            ),
        )
        show(page, self.summary)
        panels, names = [], list(self.vehicles.values())
        largest = self.by_vehicle.groupby("vehicle")["share_total"].max()
        drawn = drawn_rows(largest.loc[names].to_numpy())
        for variable, rows in self.by_vehicle.groupby("direction", sort=False):
            total, half = rows["share_total"].to_numpy(), rows["share_half_width"].to_numpy()
            if not total.max() >= PERCENT * NEGLIGIBLE:
                continue
            total, half = total[drawn], half[drawn]
            alone = rows["share_alone"].to_numpy()[drawn]
            groups = {
                say("with others, 95 %", "mit anderen, 95 %"): (total, total - half, total + half),
                say("alone", "allein"): (alone, alone, alone),
            }
            panels.append(plot.IntervalPanel(say("share [%]", "Anteil [%]"), groups, str(variable)))
        if panels:
            page.figure(
                plot.interval_panels([names[row] for row in drawn], panels, columns=3),
                say(
                    f"Shares in every vehicle, of directions with {PERCENT * NEGLIGIBLE:g} % or "
                    "more in one.",
                    "Anteile in jedem Fahrzeug, von Richtungen mit mindestens "
                    f"{page.local(PERCENT * NEGLIGIBLE)} % in einem.",
                )
                + self._not_drawn(len(drawn)),
            )
        matters = self.by_vehicle.groupby("direction")["share_total"].transform("max")
        shown = self.by_vehicle[matters >= PERCENT * NEGLIGIBLE].reset_index(drop=True)
        page.section(
            say("In every vehicle", "In jedem Fahrzeug"),
            say(
                f"Directions with less than {PERCENT * NEGLIGIBLE:g} % in every vehicle, and those "
                "that are not identified, stand in the workbook alone.",
                f"Richtungen unter {page.local(PERCENT * NEGLIGIBLE)} % in jedem Fahrzeug "
                "und nicht identifizierte stehen nur in der Arbeitsmappe.",
            )
            if len(shown) < len(self.by_vehicle)
            else "",
        )
        if len(shown):
            show(page, shown)
        page.foot = foot
        return page

    def _not_drawn(self, count: int) -> str:
        """Say how many vehicles are drawn; nothing where all are."""
        whole = len(self.vehicles)
        if count == whole:
            return ""
        return self.language.say(
            f" The {count} of {whole} vehicles with the largest share; the workbook has all.",
            f" Die {count} von {whole} Fahrzeugen mit dem größten Anteil; die Mappe hat alle.",
        )

    def _variation(self) -> str:
        """Say what varied, and how far."""
        width = f"{PERCENT * self.width:g} %"
        if self.varied is Analysis.tolerance:
            return self.language.say(
                f"Each stiffness scatters as parts do, ±{width} as three standard deviations.",
                f"Jede Steifigkeit streut wie Teile, ±{width} als drei Standardabweichungen.",
            )
        return self.language.say(
            f"Each stiffness varies on its own, evenly within ±{width} of today's.",
            f"Jede Steifigkeit variiert für sich, gleichverteilt in ±{width} um die heutige.",
        )


def importance_sheets(
    entry: RunEntry,
    runs: Runs,
    *,
    mount: str | None,
    anonymous: bool,
    language: Language,
    stem: str,
    issued: str,
    decibels: bool,
) -> dict[str, bytes]:
    """Return page and workbook of each mount of a sensitivity run, by file name.

    - `entry`: the finished run, whose files have been checked; `runs`: that it is about.
    - `mount`: the part; None: all. `issued`: day, YYYY-MM-DD.
    - `decibels`: whether they say how the level changes.
    - raises InputError: a run without dB per 10 %; an unknown mount; a leak.
    """
    platform = runs.platform
    indices = read_frame(entry.folder / INDICES, ("vehicle", "variable", "zero"))
    if SLOPE not in indices:
        raise InputError(
            f"{entry.folder / INDICES} has no column '{SLOPE}': run the study {entry.study} again"
        )
    mounts = {each.name: each for each in platform.mounts}
    if mount is not None and mount not in mounts:
        raise InputError(f"run {entry.folder} has no mount '{mount}': use {', '.join(mounts)}")
    secrets = platform_secrets(platform, entry) if anonymous else ()
    arguments = entry.record["arguments"]
    varied = Analysis(arguments["analysis"])
    width = arguments["bounds" if varied is Analysis.design else "tolerance"]
    foot = f"{issued} · deboom" + ("" if anonymous else f", {entry.name}")
    programme = read_programme(platform.folder, tuple(mounts))
    contents: dict[str, bytes] = {}
    for name, part in mounts.items():
        if mount not in (None, name):
            continue
        sheet = ImportanceSheet(
            mount=part,
            indices=indices,
            runs=runs,
            programme=programme,
            varied=varied,
            width=width,
            tolerance=arguments["tolerance"],
            language=language,
            secrets=secrets,
            issued=issued,
            decibels=decibels,
        )
        title = sheet.language.say(f"Mount {name}", f"Lager {name}")
        page, workbook = searched_documents(secrets, sheet.tables, title, partial(sheet.page, foot))
        file = f"{stem}_{name}" + "_anonymous" * anonymous
        contents |= {f"{file}.html": page.encode(), f"{file}.xlsx": workbook}
    return contents


def _letters(number: int) -> str:
    """Name the n-th of many: A to Z, then AA."""
    more, last = divmod(number, len(string.ascii_uppercase))
    return (_letters(more - 1) if more else "") + string.ascii_uppercase[last]
