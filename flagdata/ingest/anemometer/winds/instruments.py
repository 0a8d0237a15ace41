"""The anemometers of a table: which columns belong to which, in which unit, and what was left out and why."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from flagdata import compass
from flagdata.ingest.anemometer.text.cells import Cell, Numbers, numbers
from flagdata.ingest.anemometer.text.layout import Layout
from flagdata.ingest.anemometer.winds import (
    beside,
    bow,
    codes,
    gusts_beside,
    longer_periods,
    other_units,
    own_motion,
    places_in_names,
    powers,
    shipboard,
    unitcheck,
)  # fmt: skip
from flagdata.ingest.anemometer.winds.angles import compass_unit, day_of_month, degrees, may_be_points, may_be_two
from flagdata.ingest.anemometer.winds.axes import along_axes
from flagdata.ingest.anemometer.winds.directions import holds_marks, judge
from flagdata.ingest.anemometer.winds.found import COMPONENTS, SPEEDS, Column, Found, Wind
from flagdata.ingest.anemometer.winds.no_speeds import beaufort
from flagdata.ingest.anemometer.winds.vanes import number, vanes
from flagdata.ingest.anemometer.winds.weather import with_weather
from flagdata.ingest.anemometer.words.headings import Heading, fits, understand, words_of
from flagdata.ingest.anemometer.words.wind_words import WIND
from flagdata.units import unit

_DIRECTION_OF = {name: name.replace("speed", "direction") for name in SPEEDS}
_UNREADABLE = 0.1
_QUALITY, _MARKS = frozenset({"q", "qn", "qual"}), 10
"""What stands in the heading of marks of quality, and the most kinds of marks."""


def find_winds(
    layout: Layout, *, time: Sequence[int], told: str | None = None
) -> tuple[tuple[Wind, ...], tuple[str, ...], tuple[str, ...]]:
    """The anemometers of a table, remarks on what was not taken, and warnings of what is odd.

    Args:
        time: columns that are the time.
        told: unit of the wind by the user's word; it goes before the heading's.
    """
    found = _gathered(layout, time)
    for index in longer_periods.beside_readings(found):
        why = "is of a whole day or a longer time by its heading, beside readings; --wind with its name reads it"
        _leave_out(found, index, why)
    open_ones = [at for at in found.of("wind_speed") if (own := found.headings[at]).unit is None and own.height is None]
    for index, first in other_units.again(found.values, open_ones).items():
        found.remarks.append(f"column {found.name(index)!r} is {found.name(first)!r} in another unit: left out")
        del found.values[index]
    _leave_out_combinations(found)
    winds = [*_speeds(found, told), *_components(found, told)]
    winds = [with_weather(found, wind, many=len(winds) > 1) for wind in winds]
    _doubt_headings(found, winds)
    _check_gusts(found, winds)
    found.warnings.extend(gusts_beside.never_below(found, winds))
    return tuple(winds), tuple(dict.fromkeys(found.remarks)), tuple(found.warnings)


def _leave_out_combinations(found: Found) -> None:
    """Leave out marks of quality, and squares, cubes and differences of speeds, with what is their direction by its
    place: they are no speeds."""
    for index in [at for at in found.of(*SPEEDS, "wind_direction") if _marks_another(found, at)]:
        found.remarks.append(f"column {found.name(index)!r} holds marks of another column of its words: left out")
        del found.values[index]
    speeds = found.of("wind_speed")
    for index, (base, power) in powers.of_others(found.values, speeds).items():
        _leave_out(found, index, f"is the {power} of {found.name(base)!r}, no speed")
    labels = {at: found.headings[at].label for at in found.of("wind_speed") if found.headings[at].height is None}
    for index in [at for at in powers.cubes_by_name(labels) if found.headings[at].unit is None]:
        _leave_out(found, index, "is a mean cube by the number behind its name, unless --wind names it")
    for index, (first, second) in powers.differences(found.values, found.of("wind_speed")).items():
        _leave_out(found, index, f"is {found.name(first)!r} less {found.name(second)!r}, no speed")


def _leave_out(found: Found, index: int, why: str) -> None:
    """Leave out a column, and its direction where columns with the same headings are repeated for each instrument."""
    found.remarks.append(f"column {found.name(index)!r} {why}: left out")
    channel, key = found.headings[index].channel, found.key(index)
    alike = [at for at in found.of(channel) if found.key(at) == key]
    towards = [at for at in found.of(_DIRECTION_OF[channel]) if found.key(at) == key]
    if len(towards) == len(alike) > 1:
        del found.values[towards[alike.index(index)]]
    del found.values[index]


def _gathered(layout: Layout, time: Sequence[int], *, speed: int | None = None) -> Found:
    """The columns whose heading names a quantity, and their values.

    Args:
        time: columns that are the time.
        speed: a column that is a speed of the wind by the user's word.
    """
    headings = [bow.heading_of(layout, index) for index in range(len(layout.names))]
    headings = shipboard.as_coded(gusts_beside.as_gusts(layout, headings))
    headings, of_earth = along_axes(layout, headings)
    for index in [at for at, heading in enumerate(headings) if at == speed or heading.channel == "wind_speed"]:
        own = beside.direction_of(layout, index, apart=time)
        if own is not None and (not headings[own].quantity or index == speed):
            headings[own] = beside.as_direction(headings[own], of=headings[index])
    found = Found(layout=layout, headings=headings, of_earth=of_earth)
    for index, heading in enumerate(headings):
        if index in time or not heading.quantity or day_of_month(layout, index):
            continue
        calm = compass.STILL if heading.quantity.endswith("wind_speed") else ()
        parsed = numbers(layout.column(index), decimal=layout.decimal, zeros=calm, below=bool(calm))
        points = compass_unit(layout, index) if may_be_points(heading) else None
        if points is not None:
            found.values[index] = degrees(layout, index, points)
            quantity = heading.quantity.replace("speed", "direction")
            found.headings[index] = replace(
                heading, unit=points, quantity=quantity, channel="" if heading.spread else quantity
            )
        elif float((parsed.state == Cell.UNREADABLE).mean()) > _UNREADABLE and not _few_words(found, index, parsed):
            if heading.quantity.endswith("direction") and may_be_two(layout, index):
                found.remarks.append(f"column {heading.name!r} holds points whose O may be east or west: left out")
                continue
            found.remarks.append(f"column {heading.name!r} holds words, not numbers: left out")
        elif bool(np.isfinite(parsed.value).any()):
            found.values[index] = parsed.value
        elif not heading.spread:
            found.remarks.append(f"column {heading.name!r} is empty in the first rows: left out")
    for index in vanes(found.headings, found.values):
        found.headings[index] = replace(found.headings[index], channel="wind_direction", quantity="wind_direction")
    return found


def _few_words(found: Found, index: int, parsed: Numbers) -> bool:
    """Whether a column holds numbers, and a few words that say why there is none; of a wind, that is said."""
    cells = found.layout.column(index)
    listed = codes.words(cells, parsed)
    told = [word for word in listed if word.lower() not in compass.STILL]
    if told and "wind" in found.headings[index].quantity:
        found.warnings.append(
            f"column {found.headings[index].name!r} holds {', '.join(map(repr, told))} in some of the first "
            f"{len(cells)} rows, where others hold numbers: taken for no value"
        )
    return bool(listed)


def _doubt_headings(found: Found, winds: Sequence[Wind]) -> None:
    """Warn where headings leave open whether a speed is the wind's."""
    words = [set(words_of(name)) for name in found.layout.names]
    windy = any("wind" in word or word in WIND for name in words for word in name)
    windy = windy or bool(found.of("wind_direction", *COMPONENTS))
    for wind in winds:
        speed = wind.columns.get("wind_speed")
        if speed is not None and not windy and words[speed.index] & {"speed", "velocity", "vel"}:
            found.warnings.append(
                f"the heading of {wind.label!r} does not say that the speed is the wind's: taken as wind"
            )


def named_wind(
    layout: Layout, column: str, *, time: Sequence[int], told: str | None
) -> tuple[tuple[Wind, ...], tuple[str, ...]]:
    """The anemometer whose speed is in the column that the user names by heading or number, if any, and what is odd.

    Its direction is the one that is called after it, else the one that the table holds, where no other speed may be
    that direction's.
    """
    indices = [index for index, name in enumerate(layout.names) if name == column]
    if not indices and column.isdigit() and 1 <= int(column) <= layout.number_of_columns():
        indices = [int(column) - 1]
    name = layout.names[indices[0]] if len(indices) == 1 else ""
    if len(indices) != 1 or name in beaufort(layout):
        return (), ()
    stated = understand(name, layout.units[indices[0]])
    known = stated.unit if fits("wind_speed", stated.unit) else None
    odd = [_otherwise(name, known, told)] if told is not None and known is not None and told != known else []
    odd += [f"the heading of {name!r} is of a gust, an extreme or a spread: taken as you said"] * stated.spread
    how = f"in {told}, as you said" if told else f"in {known} by its heading" if known else ""
    speed = Column(index=indices[0], unit=told or known, told=how)
    found = _gathered(layout, time, speed=indices[0])
    columns, towards = {"wind_speed": speed}, None
    if (own := beside.direction_of(layout, indices[0], apart=time)) in found.of("wind_direction"):
        towards = _as_direction(found, own, "wind_direction")
    elif len(found.of("wind_direction")) == 1 and not [at for at in found.of(*SPEEDS) if at != indices[0]]:
        towards = _direction(found, indices[0], "wind_direction")
    columns |= {} if towards is None else {towards[0]: towards[1]}
    return (Wind(label=column, height=stated.height, columns=columns, sure=True),), tuple(odd)


def _otherwise(name: str, stated: str, told: str) -> str:
    return f"the heading of {name!r} states {stated}; taken as {told}, as you said"


def _column(found: Found, index: int, channel: str, told: str | None) -> Column:
    """A column of a speed with its unit."""
    stated = found.headings[index].unit
    stated = stated if fits(channel, stated) else None
    if told is None or told == stated:
        return Column(index=index, unit=stated, told="" if stated is None else f"in {stated} by its heading")
    if stated is not None:
        name = found.layout.names[index]
        found.warnings.append(_otherwise(name, stated, told))
    return Column(index=index, unit=told, told=f"in {told}, as you said")


def _speeds(found: Found, told: str | None) -> list[Wind]:
    groups: dict[tuple[object, ...], dict[str, list[int]]] = {}
    own = _of_the_platform(found)
    for index in [at for at in found.of(*SPEEDS) if at not in own]:
        groups.setdefault(found.key(index), {}).setdefault(found.headings[index].channel, []).append(index)
    named = [i for i in found.of(*SPEEDS) if found.headings[i].sure and i not in own]
    moving = own_motion.may_have_speed(found.layout)
    winds: list[Wind] = []
    for by_channel in groups.values():
        members = [i for indices in by_channel.values() for i in indices]
        if named and not any(found.headings[i].sure for i in members):
            for i in members:
                stated = found.headings[i].unit
                told_by = f"is in {stated}" if stated else "may be a speed"
                found.remarks.append(f"column {found.layout.names[i]!r} {told_by}, but nothing says that it is a wind")
            continue
        kept = {channel: _distinct(found, indices) for channel, indices in by_channel.items()}
        for at in range(max(map(len, kept.values()))):
            speeds = {channel: indices[at] for channel, indices in kept.items() if at < len(indices)}
            # The user's unit is that of the speeds without one, where others of the table state theirs.
            open_ones = [index for index in speeds.values() if not fits("wind_speed", found.headings[index].unit)]
            columns = {
                channel: _column(found, index, channel, told if not open_ones or index in open_ones else None)
                for channel, index in speeds.items()
            }
            first = next(iter(speeds.values()))
            for channel, index in speeds.items():
                towards = _direction(found, index, _DIRECTION_OF[channel])
                if towards is not None:
                    columns[towards[0]] = towards[1]
            lone = _of_anything(found.layout.names[first])
            winds.append(Wind(
                label=found.name(first), height=found.headings[first].height, columns=columns,
                sure=(found.headings[first].sure and not (lone and moving)) or _of_a_mast(found, first),
            ))  # fmt: skip
    if any(wind.sure for wind in winds):
        found.remarks.extend(
            f"column {wind.label!r} may be a speed, but nothing says that it is the wind's: left out"
            for wind in winds if not wind.sure
        )  # fmt: skip
        winds = [wind for wind in winds if wind.sure]
    return winds


def _of_anything(name: str) -> bool:
    """Whether a heading is a speed and does not say that it is the wind's."""
    said = set(words_of(name))
    return bool(said & {"speed", "spd", "velocity", "vel"}) and not any("wind" in word for word in said)


def _of_a_mast(found: Found, index: int) -> bool:
    """Whether a mean speed at a stated height has its spread or extremes beside it, in a table with directions."""
    heading = found.headings[index]
    if heading.height is None or not heading.mean or heading.unit is None or not found.of("wind_direction"):
        return False
    return any(
        other.spread and other.height == heading.height and other.label == heading.label and other.unit == heading.unit
        for other in found.headings
    )


def _of_the_platform(found: Found) -> list[int]:
    """Speeds of nothing that is named, beside the wind past a platform that moves: they are the platform's own."""
    if not found.of("apparent_wind_speed", "theoretical_wind_speed"):
        return []
    own = [at for at in found.of("wind_speed") if _of_anything(found.layout.names[at])]
    found.remarks.extend(
        f"column {found.name(at)!r} is likely the platform's own speed, beside the wind past it: left out" for at in own
    )
    return own


def _distinct(found: Found, indices: Sequence[int]) -> list[int]:
    """Those of columns with the same words that are readings of their own: not another unit, not the mean of one."""
    order = sorted(
        indices, key=lambda i: (found.headings[i].unit is None, found.headings[i].mean, found.headings[i].unit != "m/s")
    )
    kept: list[int] = []
    for index in order:
        heading = found.headings[index]
        same = next((other for other in kept if _same(found, index, other)), None)
        if same is None and _marks_quality(found, index, indices):
            found.remarks.append(f"column {found.name(index)!r} holds marks of another column of its name: left out")
        elif same is None:
            kept.append(index)
        else:
            found.remarks.append(
                f"column {heading.name!r} is {found.layout.names[same]!r} again, averaged or in another unit"
            )
    return sorted(kept)


def _marks_quality(found: Found, index: int, indices: Sequence[int]) -> bool:
    """Whether a column holds one or two whole numbers, where another of the same name holds more."""
    name = found.layout.names[index]
    kinds = {
        i: np.unique(found.values[i][np.isfinite(found.values[i])]) for i in indices if found.layout.names[i] == name
    }
    own = kinds[index]
    return len(own) <= 2 and bool(np.all(own % 1 == 0)) and any(len(other) > 2 for other in kinds.values())


def _marks_another(found: Found, index: int) -> bool:
    """Whether a column has a letter of quality before the words of another (Q_FF beside FF), and holds few numbers."""
    heading, value = found.headings[index], found.values[index]
    bare = tuple(word for word in heading.label if word not in _QUALITY)
    if len(bare) == len(heading.label):
        return False
    alike = [at for at in found.of(heading.channel) if found.headings[at].label == bare]
    kinds = np.unique(value[np.isfinite(value)])
    few = len(kinds) <= _MARKS and bool(np.all(kinds % 1 == 0))
    return few and any(found.headings[at].height == heading.height for at in alike)


def _same(found: Found, index: int, other: int) -> bool:
    one, two = found.headings[index], found.headings[other]
    if one.mean != two.mean:
        return True
    if one.unit is None or two.unit is None or one.unit == two.unit:
        return False
    ratio = found.values[index] * unit(one.unit).scale, found.values[other] * unit(two.unit).scale
    return bool(np.nanmedian(np.abs(ratio[0] - ratio[1])) <= 0.1 * np.nanmedian(np.abs(ratio[0])) + 0.3)


def _components(found: Found, told: str | None) -> list[Wind]:
    groups: dict[tuple[object, ...], dict[str, int]] = {}
    for index in found.of(*COMPONENTS):
        groups.setdefault(found.key(index), {}).setdefault(found.headings[index].channel, index)
    winds: list[Wind] = []
    speeds = found.of("wind_speed")
    for key, indices in groups.items():
        if not {"wind_x", "wind_y"} <= set(indices):
            continue
        if any(found.key(index) == key for index in speeds):
            names = ", ".join(found.layout.names[index] for index in indices.values())
            found.remarks.append(f"components {names} are left out beside the speed")
            continue
        columns = {
            channel: _column(found, indices[channel], channel, told) for channel in COMPONENTS if channel in indices
        }
        first = indices["wind_x"]
        if "wind_z" in columns and powers.is_length([found.values[indices[at]] for at in ("wind_x", "wind_y")],
                                                    found.values[indices["wind_z"]]):  # fmt: skip
            del columns["wind_z"]
            name = found.name(indices["wind_z"])
            found.remarks.append(f"column {name!r} is the length of the other two, no wind upwards: left out")
        own = [
            at for at in found.of("wind_direction") if found.headings[at].height in (None, found.headings[first].height)
        ]
        if own and not speeds:
            names = ", ".join(repr(found.name(at)) for at in own)
            found.remarks.append(f"the direction {names} is left out beside the components")
        if found.of_earth:
            found.warnings.append(
                "the headings name components of north and east: taken as towards which the wind blows"
            )
        winds.append(Wind(
            label=found.name(first), height=found.headings[first].height, columns=columns,
            sure=found.headings[first].sure, of_earth=found.of_earth,
        ))  # fmt: skip
    return winds


def _direction(found: Found, speed: int, channel: str) -> tuple[str, Column] | None:
    """The direction that belongs to a speed, as a channel and a column."""
    name = found.layout.names[speed]
    candidates = [
        at for at in found.of(channel)
        if not places_in_names.are_of_two(name, found.layout.names[at])
        and not holds_marks(found.headings[at], found.values[at])
    ]  # fmt: skip
    exact = [index for index in candidates if found.key(index) == found.key(speed)]
    height = found.headings[speed].height
    near = [i for i in candidates if height is not None and found.headings[i].height is not None
            and abs(float(found.headings[i].height or 0) - height) <= max(5.0, 0.15 * height)]  # fmt: skip
    near.sort(
        key=lambda i: (
            abs(float(found.headings[i].height or 0) - float(height or 0)),
            found.headings[i].label != found.headings[speed].label,
        )
    )
    own = found.key(candidates[0]) if len(candidates) == 1 else ()
    of_another = bool(own[:-1]) and own != found.key(speed) and any(found.key(i) == own for i in found.of(*SPEEDS))
    of_another = of_another or (len(candidates) == 1 and _numbered_otherwise(found, speed, candidates[0]))
    lone = candidates if len(candidates) == 1 and not of_another else []
    exact = exact or _of_its_number(found, speed, candidates)
    alike = [index for index in found.of(found.headings[speed].channel) if found.key(index) == found.key(speed)]
    if len(exact) == len(alike) > 1:
        exact = [exact[alike.index(speed)]]  # blocks of columns with the same headings, one an instrument
    elif len(exact) > 1 and len(alike) > 1 and len({found.layout.names[at] for at in exact}) == 1:
        exact = _next_to(found, speed, exact)
    plain = [i for i in candidates if not found.headings[i].label and found.headings[i].height is None]
    exact.sort(key=lambda i: (_points(found.headings[i]), found.headings[i].unit is None))
    chosen = exact or near[:1] or lone or plain
    if not chosen:
        if candidates:
            names = ", ".join(repr(found.layout.names[i]) for i in candidates)
            found.remarks.append(f"none of the directions {names} is surely that of {found.name(speed)!r}: left out")
        return None
    index = next((i for i in chosen if not found.headings[i].magnetic), chosen[0])
    angles = [i for i in candidates if not _points(found.headings[i]) and not found.headings[i].magnetic]
    if _points(found.headings[index]) and len(angles) == 1:
        index = angles[0]  # the same in degrees
    return _as_direction(found, index, channel)


def _next_to(found: Found, speed: int, directions: Sequence[int]) -> list[int]:
    """Of directions with the same heading the one in the column behind a speed, else the one before; none elsewhere."""
    beside_it = [at for at in (speed + 1, speed - 1) if at in directions]
    return beside_it[:1]


def _as_direction(found: Found, index: int, channel: str) -> tuple[str, Column] | None:
    """A column as a direction, by its heading and numbers; `None` where they are none."""
    heading, value = found.headings[index], found.values[index]
    side = bow.side(found.layout, index) if channel.startswith(("apparent", "theoretical")) else None
    if side is not None:
        told = f"column {found.name(side)!r} tells the side of the bow on which {heading.name!r} is, 0° to 180°"
        found.warnings.append(f"{told}: the angle alone is no direction, and is left out")
        return None
    judged = judge(heading, value, channel)
    if judged.left_out:
        found.remarks.append(f"column {heading.name!r} {judged.left_out}")
        return None
    if judged.unit is None:
        return None
    if judged.doubt:
        found.warnings.append(f"column {heading.name!r} {judged.doubt}")
    if heading.magnetic and channel == "wind_direction":
        channel = "wind_direction_magnetic"
    told = f"{judged.told}, to which the wind blows" if heading.towards else judged.told
    return channel, Column(index=index, unit=judged.unit, told=told, towards=heading.towards)


def _of_its_number(found: Found, speed: int, candidates: Sequence[int]) -> list[int]:
    """The direction that has a speed's number and words of no other (WV2 or Vane 2 beside AN2Speed), if one does."""
    own = number(found.headings[speed])
    speeds = [at for at in found.of(found.headings[speed].channel) if number(found.headings[at]) == own]
    numbered = [at for at in candidates if number(found.headings[at]) == own]
    if not own or len(speeds) != 1 or len(numbered) != 1:
        return []
    heading = found.headings[numbered[0]]
    return numbered if heading.label == (own,) and heading.height == found.headings[speed].height else []


def _numbered_otherwise(found: Found, speed: int, direction: int) -> bool:
    """Whether a direction has the number of another speed, and this speed has not (WD2 beside AN1Speed, AN2Speed)."""
    own = number(found.headings[direction])
    others = {number(found.headings[at]) for at in found.of(*SPEEDS) if at != speed}
    return bool(own) and own != number(found.headings[speed]) and own in others


def _points(heading: Heading) -> bool:
    return heading.unit in compass.BY_UNIT


def _check_gusts(found: Found, winds: Sequence[Wind]) -> None:
    """Remark gusts whose ratio to the mean no wind has: their units differ."""
    gusts = [
        i for i in found.values
        if found.headings[i].spread and found.headings[i].quantity == "wind_speed"
        and set(words_of(found.layout.names[i])) & {"gust", "gusts", "max", "maximum", "windgust", "peak"}
    ]  # fmt: skip
    for wind in winds:
        speed = wind.columns.get("wind_speed")
        mine = [i for i in gusts if speed is not None and found.key(i) == found.key(speed.index)]
        if speed is None or not mine:
            continue
        own, other = unit(speed.unit or "m/s").scale, unit(found.headings[mine[0]].unit or speed.unit or "m/s")
        if other.si != "m/s":
            continue
        ratio = unitcheck.gust_factor(found.values[speed.index] * own, found.values[mine[0]] * other.scale)
        if ratio is not None:
            found.warnings.append(
                f"gusts {found.layout.names[mine[0]]!r} are {ratio:.2g} times the wind {wind.label!r}, which no wind "
                "is: one of the two is in another unit"
            )
