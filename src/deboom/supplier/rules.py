"""The rules that a delivery is judged by: the sheet states them, and so does the verdict."""

from __future__ import annotations

from deboom.arrays import PERCENT
from deboom.explore.moments import CONFIDENCE
from deboom.files.acceptance import AGREES, STATE_TOLERANCE
from deboom.language import Language
from deboom.supplier.delivery import INTERVAL


def acceptance_rules(
    language: Language,
    *,
    share: float | None,
    uncertainty: float | None,
    cpk: float | None,
    of_sheet: bool,
) -> tuple[str, ...]:
    """Return every rule in words, in the order in which they are applied.

    Parameters
    ----------
    language : Language
    share : float or None
        Share of the pieces that must lie inside [1]; None: no limit applies, nothing is judged.
    uncertainty : float or None
        Measuring uncertainty, relative, expanded to 95 % [1]; None: not stated.
    cpk : float or None
        Demanded Cpk [1]; None: not demanded.
    of_sheet : bool
        Parts are measured at the states of a sheet; otherwise at the condition of a box.
    """
    say = language.say

    def percent(value: float) -> str:
        return language.local(f"{PERCENT * value:.4g} %")

    force, moved, line = (percent(value) for value in STATE_TOLERANCE.values())
    guard = f"± {percent(uncertainty)}" if uncertainty else ""
    sure = percent(1.0 - INTERVAL[0])
    rules = []
    if of_sheet:
        rules += [
            say(
                f"State: a row counts if its preload is within ± {force}, its amplitude within ± "
                f"{moved} and its frequency within ± {line} of this sheet, and if it has the part "
                "number of this sheet; other rows are refused.",
                f"Zustand: eine Zeile zählt, wenn ihre Vorlast auf ± {force}, ihre Amplitude auf ± "
                f"{moved} und ihre Frequenz auf ± {line} zu diesem Blatt passt und sie seine "
                "Teilenummer hat; andere Zeilen werden abgewiesen.",
            ),
            say(
                "Value: |K| decides; loss factor and static rate are reported beside it. K' and "
                f"K'' must agree with |K| within {percent(AGREES)}. With rows of today's part, "
                "ratios to their mean count.",
                "Wert: |K| entscheidet; Verlustfaktor und statische Rate werden daneben angegeben. "
                f"K' und K'' müssen auf {percent(AGREES)} zu |K| passen. Mit Zeilen des heutigen "
                "Teils zählt das Verhältnis zu deren Mittel.",
            ),
        ]
    if share is None:
        rules.append(
            say(
                "Part: no direction is a must, so no part fails by this sheet. Values outside a "
                "preferred band are agreed one by one before a part is built.",
                "Teil: keine Richtung ist ein Muss, nach diesem Blatt fällt kein Teil durch. Werte "
                "außerhalb eines bevorzugten Bandes werden vor dem Bau einzeln vereinbart.",
            )
        )
        return tuple(rules)
    by, than = "", ""
    if uncertainty:
        by = say(
            f", by more than the measuring uncertainty of {guard} (95 %; ISO 14253-1, applied "
            "once)",
            f", um mehr als die Messunsicherheit von {guard} (95 %; ISO 14253-1, einmal angewandt)",
        )
        than = say(
            " by more than this; in between it is undecided",
            " um mehr als diese; dazwischen ist es unentschieden",
        )
    rules += [
        say(
            f"Part: it passes if |K| is inside every band of the class must{by}. It fails if |K| "
            f"is outside such a band{than}.",
            f"Teil: es besteht, wenn |K| in jedem Muss-Band liegt{by}. Es fällt durch, wenn |K| "
            f"außerhalb eines Bandes liegt{than}.",
        ),
        say(
            "Batch: it fails if one part fails. It passes if every measured part passes and the "
            f"measured parts show with {sure} confidence that at least {percent(share)} of all "
            "its pieces are inside. Otherwise it is undecided: measure more pieces.",
            "Charge: sie fällt durch mit einem durchgefallenen Teil. Sie besteht, wenn jedes "
            f"gemessene Teil besteht und sie mit {sure} Sicherheit zeigen, dass mindestens "
            f"{percent(share)} aller Stücke innen liegen. Sonst ist sie unentschieden: mehr Stücke "
            "messen.",
        ),
        say(
            "Corner of the box: the customer also predicts the cars. A batch near the ends of "
            "several bands at once may make too many cars loud. This is reported with the verdict "
            "and does not change it.",
            "Ecke der Box: der Kunde berechnet auch die Fahrzeuge. Eine Charge nahe den Enden "
            "mehrerer Bänder zugleich kann zu viele davon laut machen; das wird mit dem Urteil "
            "genannt und ändert es nicht.",
        ),
    ]
    if cpk is not None:
        wanted = language.local(f"{cpk:.4g}")
        bound = percent(CONFIDENCE)
        rules.append(
            say(
                f"Process: its Cpk [1] is shown if the lower {bound} bound (Bissell) reaches "
                f"{wanted} in every direction of the class must, missed if the value of the "
                "sample itself is lower, and open in between. It is judged separately from the "
                "batch.",
                f"Prozess: sein Cpk [1] ist gezeigt, wenn die untere {bound}-Schranke (Bissell) "
                f"{wanted} in jeder Muss-Richtung erreicht, verfehlt, wenn schon der Wert der "
                "Stichprobe darunter liegt, sonst offen. Er wird getrennt von der Charge "
                "beurteilt.",
            )
        )
    return tuple(rules)
