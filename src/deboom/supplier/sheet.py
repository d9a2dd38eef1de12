"""The tables of a part's sheet, which a mount supplier quotes and signs.

Columns are keys of `deboom.files.supplier_words`; `PartSheet.tables` has their labels.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
import pandas as pd
from scipy.stats import norm

from deboom import plot
from deboom.arrays import PERCENT, RealArray
from deboom.errors import InputError
from deboom.explore.moments import CONFIDENCE
from deboom.files.acceptance import DATA_SHEET, Programme, SheetDirection, SupplierSpecification
from deboom.files.supplier_words import label, labelled, said
from deboom.language import Language
from deboom.supplier.rules import acceptance_rules

ABOVE = 1.25
"""A process is taken to run at this multiple of the usual Cpk when that one is to be proven [1]."""
NAN = float("nan")
SHORT_HASH = 12
"""Characters of a hash that a sheet shows."""
MOVED = 0.005
"""Relative change from which a number of an older sheet counts as moved [1]."""
RATIO = (
    "direction",
    "duty",
    "lower_share",
    "nominal_share",
    "upper_share",
    "half_width",
    "loss_factor",
    "set_by_limit",
    "saving",
)
"""Columns of the data block that hold at every state."""
AT_STATE = (
    "direction",
    "preload_n",
    "preload_mm",
    "amplitude_mm",
    "frequency_hz",
    "lower",
    "nominal",
    "upper",
    "today",
    "today_half_width",
    "static_rate",
)
"""Columns that hold at the state that stands beside them."""
OVER_FREQUENCY = (
    "direction",
    "amplitude_mm",
    "frequency_hz",
    "lower",
    "nominal",
    "upper",
    "loss_factor",
)
"""Columns of the new part over frequency."""
MOST_LINES = 6
"""Frequencies of that table at most, unless the programme states its own."""
STEPS_HZ = (5.0, 10.0, 20.0, 50.0)
"""Steps between them."""


def required_capability(share: float, n_axes: int) -> float:
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


def measured_capability(demanded: float, n_parts: int, confidence: float) -> float:
    """Return the Cpk that a sample must show so that its lower bound is the demanded one [1].

    Parameters
    ----------
    demanded : float
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
    c = demanded**2 - z**2 / (9.0 * n_parts)
    return float((demanded + np.sqrt(demanded**2 - a * c)) / a)


def proving_parts(demanded: float, shown: float, confidence: float) -> int:
    """Return how many parts that show a Cpk prove a lower one [1]."""
    n_parts = np.arange(4, 1_000_000)
    z = float(norm.ppf(confidence))
    bound = shown - z * np.sqrt(1.0 / (9.0 * n_parts) + shown**2 / (2.0 * (n_parts - 1)))
    return int(n_parts[np.argmax(bound >= demanded)])


@dataclass(frozen=True)
class DirectionFacts:
    """What a sheet says of a direction beside its demand.

    Parameters
    ----------
    today_half_width : float
        95 % half width of today's stiffness, over it; nan: not stated [1].
    set_by_limit : str
        Ends of the band that a limit sets: ``from``, ``to``, ``from and to``, or nothing.
    saving : float
        Price per part that a free direction saves; nan: none [currency].
    """

    today_half_width: float = NAN
    set_by_limit: str = ""
    saving: float = NAN


@dataclass(frozen=True, eq=False)
class SheetCurves:
    """Pictures of a sheet, and the points behind them.

    Parameters
    ----------
    axes : mapping of str to array
        Label of each axis of the part → where it points, (3,) [1].
    axes_caption : str
        How they stand in the vehicle.
    along : array or None
        Axis of a round part, (3,) [1]; None: the part is drawn as a block.
    panels : sequence of plot.CurvePanel
        Of each direction, where they were measured: dynamic stiffness over static force and over
        frequency, static force over deflection.
    colours : mapping of str to str
        Of all labels in them.
    dashed : tuple of str
        Labels of dashed curves.
    points : DataFrame
        Keyed table of the curves.
    caption : str
        What to see in them.
    """

    axes: Mapping[str, Sequence[float]]
    axes_caption: str
    along: Sequence[float] | None = None
    panels: Sequence[plot.CurvePanel] = ()
    colours: Mapping[str, str] = field(default_factory=dict)
    dashed: tuple[str, ...] = ()
    points: pd.DataFrame = field(default_factory=pd.DataFrame)
    caption: str = ""


@dataclass(frozen=True, eq=False, kw_only=True)
class PartSheet(ABC):
    """Tables and words of one part's sheet; engine and compressor mounts state what is theirs.

    Parameters
    ----------
    secrets : tuple of str
        Names and paths that an anonymous sheet may not hold; empty if it is not anonymous.
    language : Language
    issued : str
        Day, YYYY-MM-DD.
    decibels : bool
        Whether it says what the parts bring in the cabin.
    """

    secrets: tuple[str, ...]
    language: Language
    issued: str
    decibels: bool = True

    @property
    @abstractmethod
    def part(self) -> str:
        """Name of the part."""

    @property
    @abstractmethod
    def title(self) -> str:
        """Head of the page."""

    @property
    @abstractmethod
    def description(self) -> str:
        """Line below it."""

    @property
    @abstractmethod
    def agreed(self) -> Programme:
        """What both sides have agreed."""

    @property
    @abstractmethod
    def since(self) -> SupplierSpecification | None:
        """Older sheet of this part."""

    @property
    @abstractmethod
    def pieces(self) -> int:
        """Pieces per vehicle."""

    @property
    @abstractmethod
    def specification(self) -> SupplierSpecification:
        """What is demanded, in the form that is read back."""

    @property
    @abstractmethod
    def facts(self) -> tuple[DirectionFacts, ...]:
        """What the sheet says of each direction beside its demand."""

    @property
    @abstractmethod
    def acoustic_cpk(self) -> float | None:
        """Cpk per direction that the stated share of pieces needs [1]; None: no share is stated."""

    @property
    @abstractmethod
    def classes(self) -> str:
        """What the classes of the directions mean."""

    @property
    @abstractmethod
    def notes(self) -> tuple[str, ...]:
        """Paragraphs on what the data block holds for."""

    @property
    @abstractmethod
    def rests_on(self) -> str:
        """What the bands rest on, in one line."""

    @property
    @abstractmethod
    def worth(self) -> pd.DataFrame:
        """Keyed table: what stiffness and tolerance of every direction are worth in the cabin."""

    @property
    @abstractmethod
    def levels(self) -> pd.DataFrame:
        """Keyed table: what the wanted parts change."""

    @property
    @abstractmethod
    def worth_words(self) -> str:
        """What these two tables show."""

    @property
    @abstractmethod
    def over_frequency(self) -> pd.DataFrame:
        """Keyed table of the new part over frequency, at the preload of the test.

        Columns `OVER_FREQUENCY`, nan where nothing was measured; empty where nothing is known.
        """

    @property
    @abstractmethod
    def variants(self) -> pd.DataFrame:
        """Keyed table of part numbers that vehicles share; empty without."""

    @property
    @abstractmethod
    def origin(self) -> Mapping[str, str]:
        """What the sheet follows from: item → value, in the language of the sheet."""

    @property
    @abstractmethod
    def curves(self) -> SheetCurves:
        """What is drawn."""

    @property
    @abstractmethod
    def glossary(self) -> tuple[str, ...]:
        """Words that a reader may not know."""

    def word(self, key: str) -> str:
        """Return a word of the table in the sheet's language."""
        return said(key, self.language)

    def label(self, key: str) -> str:
        """Return the label of a column in the sheet's language."""
        return label(key, self.language)

    def percent(self, share: float) -> str:
        """Write a share [1] in per cent, with the decimal sign of the language."""
        return self.language.local(f"{PERCENT * share:.4g} %")

    def shown_lines(self, lowest: float, highest: float) -> RealArray:
        """Return the frequencies of the table over frequency: the programme's, or round ones.

        - `lowest`, `highest`: band of the noise [Hz].
        """
        stated = self.agreed.test.frequencies_hz or ()
        if len(stated) > 1:
            return np.sort(stated)
        for step in STEPS_HZ:
            lines = step * np.arange(np.ceil(lowest / step), np.floor(highest / step) + 1)
            if lines.size <= MOST_LINES:
                break
        return lines

    def specified(
        self,
        directions: Sequence[SheetDirection],
        *,
        box_sha256: str = "",
        share_stated: float | None = None,
    ) -> SupplierSpecification:
        """Return the specification of these directions with what every sheet states."""
        agreed, number = self.agreed, self.agreed.mount(self.part)
        return SupplierSpecification(
            mount=self.part,
            revision=number.revision or "",
            drawing=number.drawing_number or "",
            language=self.language.value,
            box_sha256=box_sha256,
            share_stated=share_stated,
            uncertainty=agreed.test.uncertainty,
            directions=tuple(directions),
            part_number=number.part_number or "",
            issued=self.issued,
            cpk=agreed.process.cpk or None,
        )

    @cached_property
    def units(self) -> dict[str, str]:
        """Units of columns that depend on the programme."""
        return {"saving": self.agreed.currency}

    @cached_property
    def block(self) -> pd.DataFrame:
        """Data block: one row per direction, the ratio to today's part first."""
        rows = []
        for demand, facts in zip(self.specification.directions, self.facts, strict=True):
            ends = f"end {facts.set_by_limit}" if facts.set_by_limit else ""
            rows.append(
                {
                    **self._compared(demand),
                    "set_by_limit": self.word(ends) if ends else None,
                    "saving": facts.saving if demand.duty == "free" else NAN,
                    "today": nan_if_none(demand.today_n_per_mm),
                    "today_half_width": PERCENT * facts.today_half_width,
                }
            )
        return pd.DataFrame(rows)[list(dict.fromkeys((*RATIO, *AT_STATE)))]

    def _compared(self, demand: SheetDirection) -> dict[str, str | float]:
        """Columns of a direction that an older sheet is compared by."""
        today = nan_if_none(demand.today_n_per_mm)
        low, high = nan_if_none(demand.lower), nan_if_none(demand.upper)
        return {
            "direction": demand.name,
            "duty": self.word(demand.duty),
            "lower_share": PERCENT * low,
            "nominal_share": PERCENT * 0.5 * (low + high),
            "upper_share": PERCENT * high,
            "half_width": PERCENT * (high - low) / (high + low),
            "loss_factor": nan_if_none(demand.loss_factor),
            **self._state(demand),
            "lower": low * today,
            "nominal": 0.5 * (low + high) * today,
            "upper": high * today,
            "static_rate": nan_if_none(demand.static_rate_n_per_mm),
        }

    def _state(self, demand: SheetDirection) -> dict[str, float]:
        return {
            "preload_n": nan_if_none(demand.preload_n),
            "preload_mm": nan_if_none(demand.preload_mm),
            "amplitude_mm": nan_if_none(demand.amplitude_mm),
            "frequency_hz": nan_if_none(demand.frequency_hz),
        }

    @cached_property
    def tested(self) -> list[SheetDirection]:
        """Directions with a line of the test: each must, or what is preferred if there is none."""
        musts = list(self.specification.musts.values())
        return musts or [d for d in self.specification.directions if d.duty == "preferred"]

    @cached_property
    def test(self) -> pd.DataFrame:
        """One row per line of the test: state, specification limits, guarded limits."""
        guard, rows = self.specification.uncertainty, []
        for demand in self.tested:
            today, low, high = map(nan_if_none, (demand.today_n_per_mm, demand.lower, demand.upper))
            nominal, loss = 0.5 * (low + high) * today, nan_if_none(demand.loss_factor)
            size = np.sqrt(1.0 + loss**2)
            tight = (low / (1.0 - guard), high / (1.0 + guard)) if guard else (NAN, NAN)
            decides = "yes" if np.isfinite(today) else "as a ratio"
            if guard is not None and tight[0] > tight[1]:
                decides = "cannot decide"
            rows.append(
                {
                    "direction": demand.name,
                    **self._state(demand),
                    "test_lower": low * today,
                    "test_upper": high * today,
                    "guarded_lower": tight[0] * today,
                    "guarded_upper": tight[1] * today,
                    "nominal_real": nominal / size,
                    "nominal_imaginary": nominal * loss / size,
                    "loss_angle": np.degrees(np.arctan(loss)),
                    "decides": self.word(decides),
                }
            )
        return pd.DataFrame(rows)

    @cached_property
    def to_fill_in(self) -> pd.DataFrame:
        """Table that the supplier fills in: rows for one sample, the state already there."""
        rows = [
            {
                "part_number": self.specification.part_number,
                "direction": demand.name,
                "measured_preload": nan_if_none(demand.preload_n),
                "measured_amplitude": nan_if_none(demand.amplitude_mm),
                "measured_frequency": nan_if_none(demand.frequency_hz),
            }
            for _ in range(self.agreed.process.parts_per_sample)
            for demand in self.tested
        ]
        empty = dict.fromkeys(("part", "batch"), "")
        return pd.DataFrame([empty | row for row in rows], columns=self.specification.fill_in)

    @cached_property
    def process(self) -> pd.DataFrame:
        """What the process must show for every line of the test."""
        process, needed = self.agreed.process, self.acoustic_cpk
        n, usual = process.parts_per_sample, process.cpk
        demands = [("usual", usual, ABOVE * usual)] if usual else []
        if needed is not None and self.tested:
            demands.insert(0, ("acoustics", needed, max(usual, ABOVE * needed)))
        rows = []
        for line in self.tested:
            low, high = nan_if_none(line.lower), nan_if_none(line.upper)
            half = 0.5 * (high - low) * nan_if_none(line.today_n_per_mm)
            rows += [
                {
                    "direction": line.name,
                    "demanded_by": self.word(name),
                    "cpk": cpk,
                    "sigma": half / (3.0 * cpk),
                    "sigma_share": PERCENT * (high - low) / (high + low) / (3.0 * cpk),
                    "sample_size": n,
                    "sample_cpk": measured_capability(cpk, n, CONFIDENCE),
                    "process_cpk": runs_at,
                    "proving_parts": proving_parts(cpk, runs_at, CONFIDENCE),
                }
                for name, cpk, runs_at in demands
            ]
        return pd.DataFrame(rows)

    @cached_property
    def rules(self) -> tuple[str, ...]:
        """Every rule that a delivery is judged by, where no limit applies those of the test."""
        sheet = self.specification
        return acceptance_rules(
            self.language,
            share=sheet.share_stated if sheet.musts else None,
            uncertainty=sheet.uncertainty,
            cpk=sheet.cpk,
            of_sheet=True,
        )

    @cached_property
    def fields(self) -> dict[str, str]:
        """Head of the sheet by keys; an empty value has not been given."""
        agreed, number = self.agreed, self.agreed.mount(self.part)
        test, uncertainty = agreed.test, agreed.test.uncertainty
        variants = [v for v in agreed.variants if self.part in v.mounts]
        if self.secrets and variants:
            shown = str(len(variants))
        else:
            shown = "; ".join(f"{v.name}: {v.vehicles_per_year}" for v in variants)
        return {
            "part_number": number.part_number or "",
            "drawing": number.drawing_number or "",
            "revision": number.revision or "",
            "state": self.word(number.state),
            "pieces": str(self.pieces),
            "parts_per_year": str(number.parts_per_year or ""),
            "variants": shown,
            "contact": agreed.contact or "",
            "prototypes": agreed.prototypes or "",
            "start_of_production": agreed.start_of_production or "",
            "temperature": self._number(
                _with_tolerance(test.temperature_c, test.temperature_tolerance_c)
            ),
            "cycles": _text(test.conditioning_cycles),
            "conditioned": self._number(_listed(number.conditioning_force_n, 0)),
            "further": self._number(_listed((test.frequencies_hz or ())[1:], 1)),
            "second_amplitude": self._number(_text(test.second_amplitude_mm)),
            "loss_tolerance": self._tolerance(test.loss_factor_tolerance),
            "rate_tolerance": self._tolerance(test.static_rate_tolerance),
            "ageing": test.ageing or "",
            "fixture": test.fixture or "",
            "sampling": test.sampling or "",
            "first_articles": test.first_articles or "",
            "uncertainty": self._number(_text(uncertainty and PERCENT * uncertainty)),
            "weight": self._number(_listed(number.weight_force_n, 0)),
            "zero": self.word(number.curve_zero) if number.curve_zero else "",
        }

    def _number(self, text: str) -> str:
        return self.language.local(text).replace("-", "−")

    def _tolerance(self, share: float | None) -> str:
        return "" if share is None else f"± {self.percent(share)}"

    @cached_property
    def head(self) -> dict[str, str]:
        """The same with what names this sheet: the day and the checksum."""
        return {
            **self.fields,
            "issued": self.issued,
            "checksum": self.specification.checksum[:SHORT_HASH],
        }

    @cached_property
    def programme(self) -> pd.DataFrame:
        """Keyed table of the head."""
        return pd.DataFrame(
            {"field": list(map(self.label, self.head)), "value": list(self.head.values())}
        )

    @cached_property
    def missing(self) -> tuple[str, ...]:
        """Fields of the programme that have not been given."""
        return tuple(self.label(key) for key, value in self.fields.items() if not value)

    @cached_property
    def basis(self) -> pd.DataFrame:
        """What the sheet follows from: item and value."""
        items = {
            self.language.say("bands", "Bänder"): self.rests_on,
            **self.origin,
            self.language.say("checksum of this sheet", "Prüfsumme dieses Blatts"): (
                self.specification.checksum
            ),
        }
        return pd.DataFrame({"item": list(items), "value": list(items.values())})

    @cached_property
    def changes(self) -> dict[tuple[int, str], str]:
        """Cells of the data block, by row and key, that an older sheet had otherwise."""
        old = self.since
        if old is None:
            return {}
        if old.mount != self.part:
            raise InputError(
                f"--since: that sheet is of mount {old.mount}, this one of {self.part}: give "
                f"the older sheet with --mount {old.mount}"
            )
        before, moved = {d.name: d for d in old.directions}, {}
        for row, demand in enumerate(self.specification.directions):
            was = before.get(demand.name)
            former = {} if was is None else self._compared(was)
            for key, now in self._compared(demand).items():
                then = former.get(key, "–")
                if isinstance(now, float) and isinstance(then, float):
                    gone = np.isnan(then) and not np.isnan(now)
                    if (
                        gone
                        or abs(now - then) > MOVED * abs(then)
                        or np.isnan(now) > np.isnan(then)
                    ):
                        moved[row, key] = "–" if gone else f"{then:.4g}"
                elif now != then:
                    moved[row, key] = str(then)
        return moved

    @cached_property
    def tables(self) -> dict[str, pd.DataFrame]:
        """All tables with labels, by the name of their sheet in the workbook."""
        cells = self.specification.cells
        moved = [
            {
                "direction": self.specification.directions[row].name,
                "field": label(key, self.language, self.units.get(key)),
                "was": was,
            }
            for (row, key), was in self.changes.items()
        ]
        keyed = {
            "sheet_block": self.block,
            "sheet_frequencies": self.over_frequency,
            "sheet_test": self.test,
            "sheet_measured": self.to_fill_in,
            "sheet_process": self.process,
            "sheet_rules": pd.DataFrame({"rule": self.rules}),
            "sheet_worth": self.worth,
            "sheet_levels": self.levels,
            "sheet_programme": self.programme,
            "sheet_variants": self.variants,
            "sheet_basis": self.basis,
            "sheet_changes": pd.DataFrame(moved),
            "sheet_curves": self.curves.points,
        }
        tables = {
            self.word(name): labelled(table, self.language, self.units)
            for name, table in keyed.items()
            if len(table) and (self.decibels or name not in ("sheet_worth", "sheet_levels"))
        }
        data = pd.DataFrame({"entry": list(cells), "value": list(cells.values())})
        return {**tables, DATA_SHEET: data}


def rounded(value: float, decimals: int) -> float | None:
    """Round for the specification; None where there is no number."""
    return round(value, decimals) if np.isfinite(value) else None


def nan_if_none(value: float | None) -> float:
    """Return a number for a table."""
    return NAN if value is None else value


def _with_tolerance(value: float | None, half: float | None) -> str:
    return _text(value) if half is None or value is None else f"{value:g} ± {half:g}"


def _text(value: float | None) -> str:
    return "" if value is None else f"{value:g}"


def _listed(values: Sequence[float] | None, decimals: int) -> str:
    return "; ".join(f"{value:.{decimals}f}" for value in values or ())
