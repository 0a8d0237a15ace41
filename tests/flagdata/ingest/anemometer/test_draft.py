"""A draft says of each fact where it comes from, and asks what the file does not state."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from flagdata.errors import InputError, UnknownNameError, UsageError
from flagdata.ingest import OpenFactsError, WindOptions, draft, read_log
from flagdata.ingest.anemometer.draft.drafting import Draft
from flagdata.ingest.anemometer.draft.heading_words import meaning
from flagdata.ingest.anemometer.draft.table_shape import shape_of

Write = Callable[[str | bytes], Path]


def lines(heading: str, form: str, count: int = 30) -> list[str]:
    """A heading and rows of `form` at each second `s`, with a speed `v`, a direction `d` and a
    count `n`."""
    made = (
        form.format(s=s, v=f"{4 + s % 7 / 10:.1f}", d=200 + s % 9, n=s + 1) for s in range(count)
    )
    return [*heading.splitlines(), *made]


def drafted(heading: str, form: str, **options: object) -> Draft:
    found = draft(lines(heading, form), WindOptions(**options))  # type: ignore[arg-type]
    assert found is not None
    return found


def origin(found: Draft, what: str) -> str:
    (fact,) = [fact for fact in found.facts if fact.what == what]
    return fact.origin


def asked(found: Draft) -> set[str]:
    return {question.key for question in found.open}


ISO = "2026-05-01T12:00:{s:02d}Z"


def test_a_table_that_states_everything_is_stated() -> None:
    found = drafted("time,wind_speed (m/s),wind_direction (deg)", ISO + ",{v},{d}")
    assert found.stated
    assert {fact.origin for fact in found.facts} == {"stated"}


@pytest.mark.parametrize(
    ("heading", "form", "what", "expected"),
    [
        ("time,WS (m/s)", ISO + ",{v}", "wind_speed", "inferred"),
        ("time,speed (m/s)", ISO + ",{v}", "wind_speed", "inferred"),
        ("time,wind_speed (m/s),wind_direction", ISO + ",{v},{d}", "wind_direction", "assumed"),
        ("time,wind_speed (m/s),wind_direction", ISO + ",{v},NNE", "wind_direction", "inferred"),
        ("time,wind_speed (m/s)", "14.05.2026 12:00:{s:02d},{v}", "time", "inferred"),
        ("time,wind_speed (m/s)", "17776296{s:02d},{v}", "time", "inferred"),
        ("time;wind_speed (m/s)", ISO + ";{v}", "cells", "inferred"),
        ("time (UTC),wind_speed (m/s)", "2026-05-01 12:00:{s:02d},{v}", "zone", "stated"),
    ],
)
def test_each_fact_has_its_origin(heading: str, form: str, what: str, expected: str) -> None:
    found = drafted(heading, form)
    assert origin(found, what) == expected


UNIX = 1_777_636_800
"""2026-05-01T12:00:00Z."""


@pytest.mark.parametrize(
    ("scale", "form"),
    [(1, "epoch-s"), (10**3, "epoch-ms"), (10**6, "epoch-us"), (10**9, "epoch-ns")],
)
@pytest.mark.parametrize("written", [str, "{}.0".format, "{:.9e}".format])
def test_unix_time_is_read_in_each_unit_and_writing_and_is_inferred(
    scale: int, form: str, written: Callable[[int], str]
) -> None:
    table = [
        "time,wind_speed (m/s)",
        *(f"{written((UNIX + k) * scale)},{4 + k % 7 / 10}" for k in range(30)),
    ]
    found = draft(table, WindOptions())
    assert found is not None
    assert (asked(found), origin(found, "time")) == (set(), "inferred")
    assert f'format = "{form}"' in found.recipe


@pytest.mark.parametrize(
    ("heading", "cell", "says"),
    [
        (
            "time",
            "46143.5{s:02d}",
            ("2026-05-01T12:", "excel-days", "2030-05-02T12:", "excel-days-1904"),
        ),
        ("time", "2461162.5{s:02d}", ("2026-05-02T00:", "julian-days")),
        ("date", "740103.5{s:02d}", ("2026-05-01T12:", "datenum")),
        (
            "time",
            "38604816{s:02d}",
            ("2092-05-01T12:00:00 as epoch-s", "2026-05-01T12:00:00 as labview-s"),
        ),
        ("time", "6391323360000000{s:02d}", ("epoch-ns", "2026-05-01T12:00:00 as ticks")),
        ("time", "1.7776{s:02d}E+12", ("'1.777600E+12'", "rounded")),
        ("GPS time", "14616720{s:02d}", ("another origin than 1970",)),
        ("time since 1904", "20000000{s:02d}", ("another origin than 1970",)),
    ],
)
def test_a_count_that_may_be_of_another_origin_is_asked_with_the_dates_that_it_would_be(
    heading: str, cell: str, says: tuple[str, ...]
) -> None:
    found = drafted(f"{heading},wind_speed (m/s)", cell + ",{v}")
    (question,) = [one for one in found.open if one.key == "columns"]
    assert [one for one in says if one not in question.question] == []


def test_a_count_of_another_origin_is_read_where_the_user_gives_its_form() -> None:
    found = drafted(
        "GPS time,wind (m/s)", "14616720{s:02d},{v}", columns="1=time[epoch-s],2=wind_speed[m/s]"
    )
    assert found.stated


@pytest.mark.parametrize(
    ("heading", "form", "key"),
    [
        ("time,wind_speed", ISO + ",{v}", "unit"),
        ("time,wind_speed (m/s)", "2026-05-01 12:00:{s:02d},{v}", "zone"),
        ("time,wind_speed (m/s)", "05/04/2026 12:00:{s:02d},{v}", "date_order"),
        ("time,wind_speed (m/s)", "12:00:{s:02d},{v}", "date"),
        ("time,wind A (m/s),wind B (m/s)", ISO + ",{v},{v}", "wind"),
        ("when,wind_speed (m/s)", "day{n},{v}", "columns"),
        ("time,wind_speed (kn),SOG (kn)", ISO + ",{v},{v}", "platform"),
        ("time,wind_speed (m/s),Vx,Vy,roll", ISO + ",{v},{v},{v},1", "platform"),
        ("time,wind_speed (m/s),wind dir to (deg)", ISO + ",{v},{d}", "columns"),
    ],
)
def test_what_the_file_does_not_state_is_asked(heading: str, form: str, key: str) -> None:
    found = drafted(heading, form)
    assert key in asked(found)
    assert not found.stated


@pytest.mark.parametrize(
    ("options", "key"),
    [
        ({"unit": "km/h"}, "unit"),
        ({"zone": "+02:00"}, "zone"),
        ({"date_order": "dmy"}, "date_order"),
    ],
)
def test_what_the_user_gives_is_asked_no_more(options: dict[str, str], key: str) -> None:
    found = drafted("time,wind speed", "05/04/2026 12:00:{s:02d},{v}", **options)
    assert key not in asked(found)


def test_both_orders_of_a_date_are_named() -> None:
    (question,) = [
        q
        for q in drafted("time,wind_speed (m/s)", "05/04/2026 12:00:{s:02d},{v}").open
        if q.key == "date_order"
    ]
    assert "%d/%m/%Y" in question.question
    assert "%m/%d/%Y" in question.question


def test_an_hour_is_not_taken_for_minutes() -> None:
    """2026-05-01, 7 is seven o'clock, or seven minutes past midnight as loggers write clocks
    without zeros."""
    found = drafted("date,hour,wind_speed (m/s)", "2026-05-01,{s},{v}".replace("{s}", "7"))
    assert "columns" in asked(found)


def test_rows_of_several_sites_are_not_mixed() -> None:
    made = [
        "station,time,wind_speed (m/s)",
        *(f"{'AB'[k % 2]},2026-05-01T12:00:{k:02d}Z,{4 + k % 7 / 10}" for k in range(30)),
    ]
    found = draft(made, WindOptions())
    assert found is not None
    assert "sensor" in asked(found)


def test_rows_in_several_units_are_not_mixed() -> None:
    made = [
        "time,wind,unit",
        *(f"2026-05-01T12:00:{k:02d}Z,4.{k % 7},{('km/h', 'm/s')[k % 9 > 0]}" for k in range(30)),
    ]
    found = draft(made, WindOptions(unit="m/s"))
    assert found is not None
    assert "sensor" in asked(found)


def test_one_short_row_among_many_hides_no_table() -> None:
    shape = shape_of([*lines("time,wind,x", ISO + ",{v},1", 60), "2026-05-01T12:01:00Z,4.0"])
    assert shape is not None
    assert shape.delimiter == ","


def test_points_of_the_compass_of_several_languages_are_asked() -> None:
    assert "columns" in asked(drafted("time,wind_speed (m/s),wind_direction", ISO + ",{v},SO"))


def test_gusts_spreads_and_raw_numbers_are_no_wind() -> None:
    heading = "time,wind gust (m/s),wind std (m/s),wind max (m/s),wind counts,wind speed (m/s)"
    found = drafted(heading, ISO + ",{v},{v},{v},{n},{v}")
    assert found.winds == ("wind speed (m/s)",)
    assert len(found.unused) == 4


def test_the_direction_of_another_height_is_not_taken() -> None:
    found = drafted("time,wind speed 80m (m/s),wind dir 40m (deg)", ISO + ",{v},{d}")
    assert "wind_direction" not in found.recipe
    assert found.rivals == ("wind dir 40m (deg)",)


def test_components_are_read_as_such() -> None:
    found = drafted("time,u (m/s),v (m/s),w (m/s)", ISO + ",{v},{v},0.1")
    assert all(f"[channels.wind_{axis}]" in found.recipe for axis in "xyz")


@pytest.mark.parametrize(
    ("text", "delimiter", "decimal"),
    [
        (lines("a,b", "{v},{d}"), ",", "."),
        (lines("a;b", "{n},5;{d}"), ";", ","),
        (lines("a\tb", "{v}\t{d}"), "\t", "."),
        (lines("a b c", "{v}  {d} {n}"), " ", "."),
        (lines("a|b", "{v}|{d}"), "|", "."),
    ],
)
def test_the_dialect_is_found(text: list[str], delimiter: str, decimal: str) -> None:
    shape = shape_of(text)
    assert shape is not None
    assert (shape.delimiter, shape.decimal, shape.header) == (delimiter, decimal, 1)


def test_lines_above_the_heading_and_units_below_it_are_distinguished() -> None:
    shape = shape_of(lines("logger 7\nsite: roof\ntime;wind\n;m/s", "{n};{v}"))
    assert shape is not None
    assert (shape.preamble, shape.header, shape.names, shape.units) == (
        2,
        2,
        ("time", "wind"),
        ("", "m/s"),
    )


def test_text_is_no_table() -> None:
    assert shape_of(["Dear diary,", "it blew hard today."]) is None


@pytest.mark.parametrize(
    ("heading", "kind", "unit"),
    [
        ("Wind Speed [km/h]", "speed", "km/h"),
        ("ws_ms", "speed", None),
        ("WindDir", "direction", None),
        ("Windgeschwindigkeit (m/s)", "speed", "m/s"),
        ("Air Temp (°C)", "temperature", "degC"),
        ("u", "x", None),
        ("eastward_wind (m/s)", "x", "m/s"),
        ("rain (mm)", "other", "mm"),
        ("wind, kn", "speed", "kn"),
    ],
)
def test_headings_are_understood_by_their_words(heading: str, kind: str, unit: str | None) -> None:
    found = meaning(heading)
    assert (found.kind, found.unit) == (kind, unit)


COLUMNS = "date[%Y-%m-%d],time[%H:%M:%S],wind_speed[kn],,wind_direction_to[deg]"


def test_columns_are_given_in_one_line(log_file: Write) -> None:
    text = "\n".join(lines("", "2026-05-01,12:00:{s:02d},{v},x,{d}")) + "\n"
    log = read_log(log_file(text), WindOptions(columns=COLUMNS, zone="UTC"))
    assert log.series.channels["wind_speed"][0] == pytest.approx(4.0 * 1852 / 3600)
    assert np.rad2deg(log.series.channels["wind_direction"][0]) == pytest.approx(
        20.0
    )  # to 200° is from 20°
    assert log.drafted


@pytest.mark.parametrize(
    ("columns", "error", "says"),
    [
        ("time,wind_sped[kn]", UnknownNameError, "wind_speed"),
        ("time,wind_speed", UsageError, "no unit"),
        ("time,wind_speed[kn],wind_speed[kn]", UsageError, "twice"),
        ("9=time,2=wind_speed[kn]", UnknownNameError, "9"),
        ("time,,,,,,,wind_speed[kn]", InputError, "beyond"),
        ("time,wind_speed[?]", UsageError, "cannot be read"),
        ("time", UsageError, "no channel"),
    ],
)
def test_a_line_of_columns_that_does_not_fit_is_refused(
    columns: str, error: type[Exception], says: str
) -> None:
    with pytest.raises(error, match=says):
        draft(lines("a,b,c", ISO + ",{v},{d}"), WindOptions(columns=columns))


def test_nothing_is_read_while_something_is_open(log_file: Write) -> None:
    path = log_file("\n".join(lines("time,wind speed", "2026-05-01 12:00:{s:02d},{v}")) + "\n")
    with pytest.raises(OpenFactsError) as refused:
        read_log(path)
    assert {question.key for question in refused.value.questions} == {"unit", "zone"}
    assert "--unit" in refused.value.fix


@pytest.mark.parametrize(
    ("heading", "form", "key"),
    [
        ("time,wind_speed", ISO + ",{v}", "unit"),
        ("time,wind_speed (m/s)", "2026-05-01 12:00:{s:02d},{v}", "zone"),
        ("time,AWS (kn),Heading (deg)", ISO + ",{v},{d}", "wind"),
        ("time,wind A (m/s),wind B (m/s)", ISO + ",{v},{v}", "wind"),
    ],
)
def test_no_printed_line_answers_an_open_question(heading: str, form: str, key: str) -> None:
    (question,) = [one for one in drafted(heading, form).open if one.key == key]
    assert question.question.endswith("?") or question.key == "wind"
    assert question.fix() == f"--{key} {'COLUMN' if key == 'wind' else key.upper()}"


def test_one_of_several_anemometers_is_inferred_though_its_label_is_chosen() -> None:
    several = "time,wind 2m (m/s),wind 10m (m/s)"
    assert (
        origin(drafted(several, ISO + ",{v},{v}", wind="wind 10m (m/s)"), "wind_speed")
        == "inferred"
    )
    assert (
        origin(
            drafted("time,AWS (kn)", ISO + ",{v}", wind="AWS (kn)", platform="fixed"), "wind_speed"
        )
        == "given"
    )


def test_a_choice_of_the_clock_answers_the_doubt_about_the_order(log_file: Write) -> None:
    seconds = [*range(300), *range(180, 480)]
    rows = "".join(
        f"2026-05-01T12:{s // 60:02d}:{s % 60:02d}Z,{4 + s % 7 / 10:.1f}\n" for s in seconds
    )
    path = log_file("time,wind_speed (m/s)\n" + rows)
    with pytest.raises(OpenFactsError, match="goes back by 119 s"):
        read_log(path)
    time = read_log(path, WindOptions(clock="last")).series.time
    assert np.diff(time).min() > 0


@pytest.mark.parametrize(
    ("again", "refused"), [("time,temp (C),wind speed (m/s)", True), ("", False)]
)
def test_columns_that_change_places_on_the_way_are_refused(
    log_file: Write, again: str, refused: bool
) -> None:
    heading = "time,wind speed (m/s),temp (C)"
    first, second = (
        lines(heading, ISO + ",{v},12.5", 60),
        lines(again or heading, ISO.replace("T12", "T13") + ",{v},9", 60),
    )
    path = log_file("\n".join([*first, *second]) + "\n")
    if refused:
        with pytest.raises(InputError, match="names the columns anew") as caught:
            read_log(path)
        assert (caught.value.where or "").endswith("line 62")
    else:
        assert len(read_log(path).series) == 120
