"""What repeats with the revolution in the pulses of a tacho: gaps of a wheel, seam of a tape.

A toothed wheel with missing teeth and a zebra tape with a butt joint mark the revolution: the same
uneven step comes back once per turn, whatever the speed. It checks the stated number of pulses per
revolution, and gives the seam's width.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.interpolate import BSpline, make_lsq_spline
from scipy.ndimage import median_filter
from scipy.stats import binom, trim_mean

from deboom.arrays import BoolArray, IntArray, RealArray
from deboom.errors import InputError

LEAST_SLOTS = 6
"""Fewest pulses of a pattern: fewer could be one strong order of the shaft itself."""
LEAST_REVOLUTIONS = 5
"""Revolutions in which a seam must come back before its width is believed."""
LEAST_MARKS = 3
"""Marks at equal distances that contradict a count."""
RECURRING = 0.5
"""Share of the revolutions in which a mark must come back: damage hides some."""
LEAST_CHANCE = 0.01
"""Number of patterns that damage at random would make, below which a pattern is believed."""
MOST_PERIODS, MOST_STARTS = 24, 8
"""Periods, and marks to begin with, that are tried."""
CLEARLY_MORE, BY_LUCK = 0.75, 0.05
"""Share of its marks that a shorter period has of those of a longer one, and is preferred; chance
that the longer one has as many as it has, were the shorter one right, above which it is too."""
WINDOW = 9
"""Intervals over which a shaft's speed is compared with itself."""
ODD_STEP = 0.2
"""Pitches by which a step differs from one pitch, or from a whole number, to be a mark."""
LONGEST_PART, SHORTEST_SEAM = 0.85, 0.25
"""Pitches: a step beyond the first stands alone; one below the second is no seam, but a double."""
SAME_PLACE = 0.35
"""Pitches within which a mark comes back, and a pulse belongs to its place."""
SAME_WIDTH = 0.15
"""Share by which the widths of one mark differ from turn to turn."""
MOST_MARKS = 0.4
"""Odd steps per pulse beyond which nothing is learnt: noise."""
PRESENT = 0.4
"""Share of the revolutions in which a place of the pattern has its pulse."""
LEAST_FILLED = 0.6
"""Places per pitch of a pattern: fewer, and turns of the record do not lie on each other."""
WHOLE_GAP, EVEN_TEETH = 0.03, 0.01
"""Pitches from a whole number, and scatter of the others, of a wheel with missing teeth."""
LEAST_SEAM = 0.03
"""Pitches by which a joint without odd step must differ to be corrected."""
CLEAR = 5.0
"""Standard deviations of the other steps by which such a joint stands out."""
IN_EVERY_TURN = 3.0
"""Standard deviations of its own step from turn to turn by which it does."""
CHANGED_SPEED = 1.02
"""Ratio of the speeds of a record from which uneven pitches are told from samples."""
MOST_STRIPES = 240
"""Longest period that is looked for in uneven pitches [pulses]."""
ALIKE, ONE_HARMONIC, MOSTLY = 0.8, 0.5, 0.9
"""Correlation of both halves of a record from which uneven pitches come back; share of one harmonic
from which they are an order of the shaft; share that a shorter period must have of all."""
TRIMMED = 0.1
"""Share of the turns left out at each end: damaged steps. Half orders of the shaft alternate from
turn to turn, so that a median would take the one or the other."""
VISIBLE = 0.003
"""Unevenness of the pitches that tells the revolution, as a share of a pitch."""
MOST_TURNS = 6
"""Equal gaps of a wheel up to which a count is a multiple of the pattern."""
KNOT_SPACING = 4.0
"""Revolutions between the knots of the spline: two cycles of a four-stroke engine."""
DEGREE = 3
"""Of the spline."""


def smooth_course(times: RealArray, revolution: RealArray) -> BSpline[np.float64]:
    """Lay a cubic spline of least squares through pulses, knots `KNOT_SPACING` revolutions apart.

    - `times`, `revolution` (n,): of the pulses, both increasing [s], [revolutions].
    """
    wanted = np.arange(revolution[0] + KNOT_SPACING, revolution[-1], KNOT_SPACING)
    inner = np.unique(np.searchsorted(revolution, wanted))
    inner = inner[(inner >= 2) & (inner < times.size - 2)]
    ends = DEGREE + 1
    knots = np.concatenate([[times[0]] * ends, times[inner], [times[-1]] * ends])
    return make_lsq_spline(times, revolution, knots, k=DEGREE)


@dataclass(frozen=True, eq=False)
class WheelPattern:
    """Places of the pulses on the circumference, as the record shows them.

    - `even_times` (n,): times of all pulses if the places were whole pitches apart [s].
    - `pitch` (n,): pitches of all pulses since a place 0 [1].
    - `correction` (pulses per revolution,): angle of each place beyond even spacing [revolutions].
    - `note`: what was seen, for the log of a measurement.
    """

    even_times: RealArray
    pitch: RealArray
    correction: RealArray
    note: str


@dataclass(frozen=True, eq=False)
class _Places:
    """Every pulse's turn of the pattern and place in it.

    - `turn`, `place` (n,): −1 for a pulse that belongs to none.
    - `pitches` (n_place,): from the first place [pitches].
    - `period`: of the pattern [pitches].
    - `n_turns`: turns in which the mark was seen, or whole turns of the record without one.
    """

    turn: IntArray
    place: IntArray
    pitches: RealArray
    period: float
    n_turns: int


def learn_pattern(times: RealArray, pulses_per_revolution: int, name: str) -> WheelPattern | str:
    """Learn what repeats with the revolution; a sentence where there is nothing to correct.

    - `times` (n,): all pulses [s].
    - `pulses_per_revolution`: as stated.
    - raises InputError: a pattern that contradicts the stated number; a seam that too few
      revolutions show.
    """
    coordinate, width, _ = _coordinate(times, whole=False)
    places = _marked_places(coordinate, width)
    if places is None:
        return _folded(times, pulses_per_revolution, name)
    steps, _, _ = _steps(times, places)
    if not np.all(steps > 0):
        return _folded(times, pulses_per_revolution, name)
    widths = steps / np.median(steps)
    n_place, whole = steps.size, np.maximum(1, np.rint(widths)).astype(int)
    odd = np.abs(widths - 1) > ODD_STEP
    odd[-1] = True
    n_pitch = int(whole.sum())
    gap = widths[odd][np.argmax(np.abs(widths[odd] - 1))]
    seen = f"a step of {gap:.2f} pitches comes back after every {n_place} pulses"
    stated = pulses_per_revolution
    fitted, excess, uneven = _seams(steps, odd)
    is_wheel = n_pitch > n_place and bool(
        np.all(np.abs(1 + excess[odd] / fitted - whole[odd]) < WHOLE_GAP) and uneven < EVEN_TEETH
    )
    if is_wheel and stated % n_place == 0 and stated % n_pitch and stated <= MOST_TURNS * n_place:
        n_gap = stated // n_place
        several = f" where the wheel has {n_gap} equal gaps, {n_pitch} where it has one"
        raise _contradicted(
            name,
            stated,
            seen,
            n_gap * n_pitch,
            f"{several if n_gap > 1 else ''}; missing teeth count as well",
        )
    if stated == n_pitch and n_pitch > n_place:
        note = (
            f"{name}: {stated} pulses per revolution confirmed: {seen}, {places.n_turns} times, as "
            f"of {n_pitch} pitches with {n_pitch - n_place} missing; not checked is that the "
            f"wheel has one such gap: with 2 equal gaps it has {2 * n_pitch}"
        )
        return note
    if stated != n_place:
        # a seam at the edge of what counts as a mark shows as one in some turns only
        folded = _folded(times, stated, name)
        if isinstance(folded, WheelPattern):
            return folded
        return _of_other_turns(n_place, n_pitch, stated, seen, is_wheel, name)
    if places.n_turns < LEAST_REVOLUTIONS:
        raise InputError(
            f"{name}: the tape has a seam of about {gap:.2f} pitches, seen {places.n_turns} times, "
            f"which {LEAST_REVOLUTIONS} revolutions would tell safely: measure for longer"
        )
    seam = 1 + float(excess[np.argmax(np.abs(excess))] / fitted)
    note = _seam_note(name, stated, seam, places.n_turns, uneven)
    correction = _correction(fitted, excess)
    return _evened(times, places, correction, note)


def _folded(times: RealArray, stated: int, name: str) -> WheelPattern | str:
    """Fold by the stated number where no mark shows it: a small seam or uneven pitches may."""
    coordinate, width, alone = _coordinate(times, whole=True)
    n_turns = int(coordinate[-1] // stated)
    unknown = (
        f"{name}: no gap or seam comes back with the revolution: the stated {stated} pulses per "
        "revolution cannot be checked with the tacho"
    )
    other = _rough_period(times, coordinate, width)
    seen = f"pitches that differ come back after every {other} pulses"
    if other == 2 * stated:
        return (
            f"{name}: WARNING, {seen}, in every second revolution: right where half orders of an "
            f"engine do so; else state {other}"
        )
    if other not in (0, stated):
        raise _contradicted(name, stated, seen, other)
    if stated < LEAST_SLOTS:
        return unknown
    if n_turns < LEAST_REVOLUTIONS:
        _refuse_single_seam(width, coordinate[-1] / stated, name)
        return unknown
    count = np.rint(coordinate).astype(int)
    places = _Places(
        np.where(alone, count // stated, -1),
        np.where(alone, count % stated, -1),
        np.arange(stated, dtype=float),
        float(stated),
        n_turns,
    )
    steps, error, scatter = _steps(times, places)
    if not np.all(steps > 0):
        return unknown
    odd = np.zeros(stated, dtype=bool)
    pitch, _, uneven = _seams(steps, odd)
    joint = int(np.argmax(np.abs(steps / np.median(steps) - 1)))
    odd[joint] = True
    fitted, excess, rest = _seams(steps, odd)
    share = float(excess[joint] / fitted)
    # a seam that is there in every second turn only, of a tape of twice the stripes, scatters
    least = max(CLEAR * error[joint], IN_EVERY_TURN * scatter[joint])
    if abs(share) > max(LEAST_SEAM, CLEAR * rest) and abs(excess[joint]) > least:
        note = _seam_note(name, stated, 1 + share, n_turns, rest)
        return _evened(times, places, _correction(fitted, excess), note)
    if other and uneven > max(VISIBLE, CLEAR * float(np.sqrt(np.mean(error**2)) / pitch)):
        return (
            f"{name}: {stated} pulses per revolution confirmed: pitches that differ by "
            f"{100 * uneven:.2g} % rms come back with the revolution"
        )
    return unknown


def _rough_period(times: RealArray, coordinate: RealArray, width: RealArray) -> int:
    """Pulses after which uneven pitches come back, 0 where none do.

    The first half of the record tells the second the same; low harmonics are left out, for a shaft
    that turns unevenly has these, and so is one harmonic that outweighs the others. Of a shaft that
    keeps its speed nothing is told: there, samples that do not fall on the pulses come back too.
    """
    usual = median_filter(np.diff(times), size=4 * WINDOW + 1, mode="mirror")
    low, high = np.quantile(usual, [0.05, 0.95])
    if high < CHANGED_SPEED * low:
        return 0
    count = np.rint(coordinate).astype(int)
    uneven = np.full(count[-1], np.nan)
    single = (np.diff(count) == 1) & (np.abs(width - 1) < ODD_STEP)
    uneven[count[:-1][single]] = width[single] - 1
    longest, largest, power = 0, VISIBLE, np.zeros(0)
    for period in range(LEAST_SLOTS, 1 + min(MOST_STRIPES, uneven.size // LEAST_REVOLUTIONS)):
        n_turn = uneven.size // period
        turns = np.ma.masked_invalid(uneven[: n_turn * period].reshape(n_turn, period))
        halves = [part.mean(axis=0) for part in np.array_split(turns, 2)]
        if any(np.ma.count_masked(half) for half in halves):
            continue
        harmonics = np.fft.rfft(np.array(halves), axis=1)
        harmonics[:, : 1 + min(4, period // LEAST_SLOTS)] = 0
        power_of_half = np.sum(np.abs(harmonics) ** 2, axis=1)
        size = float(np.sqrt(2 * power_of_half.min())) / period
        if size <= largest:
            continue
        together = np.abs(harmonics.mean(axis=0)) ** 2
        alike = np.real(np.vdot(*harmonics)) / np.sqrt(power_of_half.prod())
        n_free = 2 * int(np.count_nonzero(together))
        least = max(ALIKE, np.tanh(CLEAR / np.sqrt(max(n_free - 3, 1))))
        if alike > least:
            longest, largest, power = period, size, together
    if power.size == 0 or power.max() > ONE_HARMONIC * power.sum():
        return 0
    # what comes back several times within the period has harmonics of that multiple alone
    several = [k for k in range(1, 1 + longest // LEAST_SLOTS) if longest % k == 0]
    return min(longest // k for k in several if power[::k].sum() > MOSTLY * power.sum())


def _refuse_single_seam(width: RealArray, n_turns: float, name: str) -> None:
    """Refuse a seam in a record that is too short to show it often enough."""
    neighbours = np.convolve(width, [1.0, 1.0])
    single = np.abs(width - 1) > SAME_WIDTH
    # a displaced or double pulse makes two steps whose sum is whole
    for step in (width, neighbours[:-1], neighbours[1:]):
        single &= np.abs(step - np.rint(step)) > ODD_STEP / 2
    if np.any(single):
        raise InputError(
            f"{name}: a step between pulses is {width[single][0]:.2f} pitches wide, such as a "
            f"tape's seam, and the {n_turns:.1f} revolutions of the record are too few to tell: "
            f"measure {LEAST_REVOLUTIONS} revolutions or more"
        )


def _contradicted(name: str, stated: int, seen: str, likely: int, more: str = "") -> InputError:
    return InputError(
        f"{name}: pulses_per_revolution says {stated}, but {seen}: state {likely}{more}"
    )


def _of_other_turns(
    n_place: int, n_pitch: int, stated: int, seen: str, is_wheel: bool, name: str
) -> str:
    """Accept a pattern that comes back in every second turn, or several times in each."""
    likely = n_pitch if is_wheel else n_place
    for count in dict.fromkeys((likely,) if is_wheel else (n_place, n_pitch)):
        if stated in [turns * count for turns in range(2, MOST_TURNS + 1)]:
            how = f"{stated // count} times per revolution"
            right = f"the wheel has {stated // count} equal gaps"
        elif count == 2 * stated:
            how, right = "in every second revolution", "the wheel turns half as fast, as a camshaft"
        else:
            continue
        return f"{name}: WARNING, {seen}, {how}: right where {right}; else state {likely}"
    raise _contradicted(name, stated, seen, likely)


def _coordinate(times: RealArray, *, whole: bool) -> tuple[RealArray, RealArray, BoolArray]:
    """Pitches from the first pulse, width of each step, and False for each double pulse.

    Steps that are nearly one pitch become one, so that nothing adds up between odd ones; with
    `whole` all become whole. Others keep their width: a seam that lies at the edge of what counts
    as a whole number of pitches would have another width in every turn. A step that makes a pitch
    with the one behind it belongs to a double pulse.
    """
    step = np.diff(times)
    step = step / median_filter(step, size=WINDOW, mode="mirror")
    nearest = np.maximum(np.rint(step), 1.0)
    made = np.where(whole | (np.abs(step - 1) < ODD_STEP), nearest, step)
    counted, alone, k = np.zeros(times.size), np.ones(times.size, dtype=bool), 0
    while k < step.size:
        length, pulses = made[k], 1
        pair = step[k] + step[k + 1] if k + 1 < step.size else 0.0
        shorter, longer = min(step[k : k + 2]), max(step[k : k + 2])
        if abs(pair - 1) < ODD_STEP and (longer < LONGEST_PART or shorter < SHORTEST_SEAM):
            length, pulses = 1.0, 2
            alone[k + 1] = False
            counted[k + 1] = counted[k] + step[k]
        counted[k + pulses] = counted[k] + length
        k += pulses
    return counted, step, alone


def _marked_places(coordinate: RealArray, width: RealArray) -> _Places | None:
    """Places of a pattern with a mark that comes back, None without one."""
    odd = np.flatnonzero(np.abs(width - 1) > ODD_STEP)
    if odd.size < LEAST_MARKS or odd.size > MOST_MARKS * coordinate.size:
        return None
    starts = _starts(coordinate[odd + 1], width[odd], coordinate)
    if starts is None:
        return None
    begin, period, n_turns = starts
    turn = np.searchsorted(begin - SAME_WIDTH, coordinate, side="right") - 1
    pitch = coordinate - begin[np.maximum(turn, 0)]
    # from the nearer mark: what damage adds up to stays small
    left = begin[np.clip(turn + 1, 0, begin.size - 1)] - coordinate
    pitch = np.where((pitch > period / 2) & (left > 0), period - left, pitch)
    inside = (turn >= 0) & (turn < begin.size - 1)
    pitches = _present(pitch[inside], turn[inside])
    if pitches.size < max(LEAST_SLOTS, LEAST_FILLED * period):
        return None
    nearest = np.argmin(np.abs(pitch[:, np.newaxis] - pitches), axis=1)
    belongs = inside & (np.abs(pitch - pitches[nearest]) < SAME_PLACE)
    return _Places(
        np.where(belongs, turn, -1),
        np.where(belongs, nearest, -1),
        pitches,
        period,
        n_turns,
    )


def _starts(
    mark: RealArray, width: RealArray, coordinate: RealArray
) -> tuple[RealArray, float, int] | None:
    """Beginnings of the turns [pitches], their period, and how many marks were there."""
    length = coordinate[-1] - coordinate[0]
    distances = []
    for ahead in range(1, mark.size):
        apart = mark[ahead:] - mark[:-ahead]
        near = apart <= length / (LEAST_MARKS - 1) + 1
        if not near.any():
            break
        alike = np.abs(np.log(width[ahead:] / width[:-ahead])) < SAME_WIDTH
        distances.append(apart[near & alike & (apart > LEAST_SLOTS - 1)])
    distance = np.sort(np.concatenate([np.zeros(0), *distances]))
    if distance.size == 0:
        return None
    best, most = None, 0.0
    for period in _periods(distance, length):
        partner = np.searchsorted(mark, mark + period - SAME_PLACE)
        near = np.abs(mark[np.minimum(partner, mark.size - 1)] - mark - period) < SAME_PLACE
        for start in np.flatnonzero(near)[:MOST_STARTS]:
            begin, hits = _followed(mark, width, int(start), period, coordinate)
            turns = begin.size - 2
            alike = np.abs(np.log(width / width[start])) < 2 * SAME_WIDTH
            by_chance = min(2 * SAME_PLACE * np.count_nonzero(alike) / length, 1.0)
            chance = binom.sf(hits - 2, turns - 1, by_chance) * mark.size**2
            share = hits / max(turns, 1)
            # a mark that damage hides now and then comes back after two and three turns as well
            if (
                hits >= max(LEAST_MARKS, RECURRING * turns)
                and chance < LEAST_CHANCE
                and CLEARLY_MORE * share > most
                # of all turns, a few in which nothing hid the mark have a larger share by luck
                and binom.sf(hits - 1, max(turns, hits), most) < BY_LUCK
            ):
                best, most = (begin, period, hits), share
    return best


def _periods(distance: RealArray, length: float) -> RealArray:
    """Distances, ascending, at which far more marks come back than chance would have it."""
    upper = np.searchsorted(distance, distance + SAME_PLACE)
    count = upper - np.arange(distance.size)
    turns = length / distance - 1
    # pairs grow rarer with their distance, as less of the record is left for them
    usual = 2 * distance.size * SAME_PLACE / length * (1 - distance / length)
    often = np.flatnonzero(
        (count >= np.maximum(RECURRING * turns - 1, LEAST_MARKS - 1))
        & (count > usual + CLEAR * np.sqrt(usual))
    )
    chosen: list[float] = []
    for first in often:
        period = float(np.median(distance[first : upper[first]]))
        if not chosen or period > chosen[-1] + SAME_PLACE:
            chosen.append(period)
        if len(chosen) == MOST_PERIODS:
            break
    return np.array(chosen)


def _followed(
    mark: RealArray, width: RealArray, start: int, period: float, coordinate: RealArray
) -> tuple[RealArray, int]:
    """Follow a mark on and back to the ends; how many turns have it."""
    begin, hits = [float(mark[start])], 1
    for sense in (1, -1):
        here = float(mark[start])
        while coordinate[0] - period < here < coordinate[-1] + 1:
            here += sense * period
            nearest = int(np.argmin(np.abs(mark - here)))
            if abs(mark[nearest] - here) < SAME_PLACE and (
                abs(np.log(width[nearest] / width[start])) < 2 * SAME_WIDTH
            ):
                here = float(mark[nearest])
                hits += 1
            begin.append(here)
    return np.sort(np.array(begin)), hits


def _present(pitch: RealArray, turn: IntArray) -> RealArray:
    """Places at which most turns have a pulse [pitches]."""
    order = np.argsort(pitch)
    groups = np.split(pitch[order], np.flatnonzero(np.diff(pitch[order]) > ODD_STEP / 2) + 1)
    # the first and the last turn are in part outside of the record
    least = PRESENT * max(np.unique(turn).size - 1, 1)
    return np.array([float(np.median(group)) for group in groups if group.size >= least])


def _steps(times: RealArray, places: _Places) -> tuple[RealArray, RealArray, RealArray]:
    """Angle of the step from each place to the next, and of the last to the first, sum 1.

    The trimmed mean over the turns of their durations times the mean speed; its standard error;
    half of the range that holds two thirds of the turns.
    """
    n_place = places.pitches.size
    at = np.flatnonzero(places.place >= 0)
    # a pulse beside another at one place is a double: it makes short steps that the median ignores
    index = places.turn[at] * n_place + places.place[at]
    at = at[np.concatenate([[True], np.diff(index) > 0])]
    index = places.turn[at] * n_place + places.place[at]
    revolution = places.turn[at] + places.pitches[places.place[at]] / places.period
    course = smooth_course(times[at], revolution)
    consecutive = np.diff(index) == 1
    middle = (times[at][1:] + times[at][:-1]) / 2
    angle = np.diff(times[at]) * course(middle, nu=1)
    from_place = places.place[at][:-1]
    angle, from_place = angle[consecutive], from_place[consecutive]
    samples = [angle[from_place == place] for place in range(n_place)]
    if min(each.size for each in samples) == 0:
        nothing = np.full(n_place, np.nan)
        return nothing, nothing, nothing
    shares = np.array([trim_mean(each, TRIMMED) for each in samples])
    # the median of unsigned normal deviations is 1/1.4826 of their standard deviation
    spread = [1.4826 * np.median(np.abs(each - np.median(each))) for each in samples]
    error = np.array(spread) / np.sqrt([each.size for each in samples])
    scatter = np.array([np.ptp(np.quantile(each, [1 / 6, 5 / 6])) / 2 for each in samples])
    total = shares.sum()
    return np.asarray(shares / total), np.asarray(error / total), np.asarray(scatter / total)


def _seams(steps: RealArray, odd: BoolArray) -> tuple[float, RealArray, float]:
    """Pitch, excess of every odd step beyond it, and rms of the other steps about it over it.

    Low orders of the shaft itself, which repeat with the revolution as well, are fitted beside, so
    that the seam does not take them.
    """
    edges = np.concatenate([[0.0], np.cumsum(steps)])
    orders = np.arange(1, 1 + min(4, max((steps.size - LEAST_SLOTS) // 3, 0)))
    phase = 2 * np.pi * orders * edges[:, np.newaxis]
    ripple = np.diff(np.hstack([np.cos(phase), np.sin(phase)]), axis=0)
    basis = np.column_stack([np.ones(steps.size), ripple, np.eye(steps.size)[:, odd]])
    coefficients, *_ = np.linalg.lstsq(basis, steps, rcond=None)
    excess = np.zeros(steps.size)
    excess[odd] = coefficients[1 + 2 * orders.size :]
    rest = (steps - basis @ coefficients)[~odd]
    return float(coefficients[0]), excess, float(np.sqrt(np.mean(rest**2)) / coefficients[0])


def _correction(pitch: float, excess: RealArray) -> RealArray:
    steps = pitch + excess
    even = np.arange(steps.size) / steps.size
    return np.asarray(np.concatenate([[0.0], np.cumsum(steps / steps.sum())[:-1]]) - even)


def _seam_note(name: str, stated: int, seam: float, n_turns: int, uneven: float) -> str:
    return (
        f"{name}: {stated} pulses per revolution confirmed: a seam of {seam:.2f} pitches comes "
        f"back {n_turns} times and is corrected; other pitches differ by {100 * uneven:.2g} % rms, "
        "which is left in"
    )


def _evened(times: RealArray, places: _Places, correction: RealArray, note: str) -> WheelPattern:
    """Shift the times of all pulses as if there were no seam."""
    n_place = correction.size
    even = np.arange(n_place + 1) / n_place
    angle = even + np.append(correction, 0.0)
    at = np.flatnonzero(places.place >= 0)
    revolution = places.turn[at] + angle[places.place[at]]
    rising = np.concatenate([[True], revolution[1:] > np.maximum.accumulate(revolution)[:-1]])
    at, revolution = at[rising], revolution[rising]
    course = smooth_course(times[at], revolution)
    inside = np.clip(times, times[at[0]], times[at[-1]])
    speed = course(inside, nu=1)
    turned = course(inside) + speed * (times - inside)
    turn = np.floor(turned)
    straight = turn + np.interp(turned - turn, angle, even)
    shifted = times + (straight - turned) / speed
    return WheelPattern(np.asarray(shifted), straight * n_place, correction, note)
