"""XML with an element a reading, and tables on pages (HTML): the samples are those that were written."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from flagdata.errors import FlagdataError, InputError
from flagdata.ingest.anemometer import WindOptions, anemometers, read_log, sniff

Write = Callable[..., Path]
HOURS = np.arange(6)
START = np.datetime64("2026-05-01T12:00", "ns")


def check(path: Path, factor: float = 1.0, **options: object) -> None:
    """The log holds the speeds 3 to 8 of its unit from 210° on, at the full hours from noon."""
    series = read_log(path, WindOptions(**options)).series  # type: ignore[arg-type]
    np.testing.assert_array_equal(series.time, (START + HOURS * np.timedelta64(1, "h")).astype(np.int64))
    np.testing.assert_allclose(series.channels["wind_speed"], factor * (HOURS + 3.0))
    np.testing.assert_allclose(np.rad2deg(series.channels["wind_direction"]), 210.0 + HOURS)


def document(
    reading: str, root: str = "<data>{}</data>", prolog: str = "<?xml version='1.0' encoding='UTF-8'?>"
) -> str:
    rows = "\n".join(reading.format(hour=12 + at, speed=3 + at, direction=210 + at) for at in HOURS)
    return f"{prolog}\n{root.format(rows)}\n"


READINGS = {
    "elements": "<obs><time>2026-05-01T{hour}:00:00Z</time>"
    "<windSpeed unit='kn'>{speed}</windSpeed><windDir>{direction}</windDir></obs>",
    "nested": "<obs time='2026-05-01T{hour}:00:00Z'>"
    "<wind><speed uom='kn'>{speed}</speed><dir>{direction}</dir></wind></obs>",
    "named": "<obs time='2026-05-01T{hour}:00:00Z'><v name='wind speed' unit='kn' value='{speed}'/>"
    "<v name='wind direction' value='{direction}'/></obs>",
    "date-parts": "<hour year='2026' month='5' day='1' hour='{hour}' minute='0'><windspd units='kn'>{speed}</windspd>"
    "<winddir units='deg'>{direction}</winddir></hour>",
}


@pytest.mark.parametrize("reading", READINGS.values(), ids=READINGS)
def test_an_element_a_reading_is_a_row(log_file: Write, reading: str) -> None:
    zone = None if "Z" in reading else "UTC"
    check(log_file(document(reading)), 1852 / 3600, zone=zone)


def test_namespaces_are_no_part_of_names(log_file: Write) -> None:
    reading = "<w:obs><w:time>2026-05-01T{hour}:00:00Z</w:time><w:windSpeed>{speed}</w:windSpeed>"
    reading += "<w:windDir>{direction}</w:windDir></w:obs>"
    check(log_file(document(reading, "<w:all xmlns:w='urn:wind'>{}</w:all>")), unit="m/s")


def test_stations_around_their_readings_are_told_apart(log_file: Write) -> None:
    reading = "<obs time='2026-05-01T{hour}:00:00Z'><windSpeed unit='m/s'>{speed}</windSpeed></obs>"
    rows = "".join(reading.format(hour=12 + at, speed=3 + at) for at in HOURS)
    other = "".join(reading.format(hour=12 + at, speed=30 + at) for at in HOURS)
    text = f"<?xml version='1.0'?><all><station id='north'>{rows}</station><station id='south'>{other}</station></all>"
    path = log_file(text)
    labels = anemometers(path)
    assert len(labels) == 2
    speeds = [read_log(path, WindOptions(wind=label)).series.channels["wind_speed"] for label in labels]
    np.testing.assert_allclose(speeds, [HOURS + 3.0, HOURS + 30.0])


def test_damaged_xml_says_where_and_what_to_do(log_file: Write) -> None:
    path = log_file(document("<obs><time>2026-05-01T{hour}:00:00Z</time><windSpeed>{speed}</windSpeed></obs>")[:-9])
    with pytest.raises(InputError, match="not well-formed") as caught:
        read_log(path)
    assert "CSV" in str(caught.value.fix)


def test_xml_with_entities_of_its_own_is_refused(log_file: Write) -> None:
    prolog = "<?xml version='1.0'?><!DOCTYPE d [<!ENTITY a 'aaaaaaaaaa'><!ENTITY b '&a;&a;&a;&a;'>]>"
    with pytest.raises(InputError, match="entities"):
        read_log(log_file(document("<obs time='2026-05-01T{hour}:00:00Z' wind='{speed}'/>", prolog=prolog)))


def test_xml_without_readings_is_told_to_be_none(log_file: Write) -> None:
    path = log_file(
        "<?xml version='1.0'?>\n<gpx><trkpt lat='1' lon='2'><time>2026-05-01T12:00:00Z</time></trkpt></gpx>\n"
    )
    assert sniff(path)[0].format == "XML"


PAGE = """<!DOCTYPE html>
<html><head><title>Wind</title><style>td {{ color: red }}</style></head><body>
<table><tr><td>menu</td><td>home</td></tr><tr><td>a</td><td>b</td></tr></table>
<p>All times are UTC. Speeds in knots.</p>
<table><tr><th>Time (UTC)</th><th>Wind&nbsp;speed [kn]</th><th>Wind direction [&deg;]</th></tr>
{rows}</table></body></html>
"""


def test_the_longest_table_of_a_page_is_read_and_the_others_are_told(log_file: Write) -> None:
    row = "<tr><td>2026-05-01 {}:00</td><td> {} </td><td>{}</td></tr>"
    path = log_file(PAGE.format(rows="\n".join(row.format(12 + at, 3 + at, 210 + at) for at in HOURS)))
    check(path, 1852 / 3600)
    assert "several-tables" in {finding.kind for finding in read_log(path).findings}


def test_cells_that_no_mark_ends_are_read(log_file: Write) -> None:
    row = "<tr><td>2026-05-01 {}:00<td>{}<td>{}"
    check(log_file(PAGE.format(rows="\n".join(row.format(12 + at, 3 + at, 210 + at) for at in HOURS))), 1852 / 3600)


def test_a_page_on_one_long_line_is_read(log_file: Write) -> None:
    row = "<tr><td>2026-05-{:02d} {:02d}:00</td><td>{}</td><td>{}</td></tr>"
    rows = "".join(row.format(1 + at // 24, at % 24, 3 + at % 6, 210) for at in range(2000 // 24 // 3 * 24))
    text = PAGE.format(rows=rows).replace("\n", "") + "<!--" + "x" * 70_000 + "-->"
    assert len(read_log(log_file(text)).series.time) == 2000 // 24 // 3 * 24


@pytest.mark.parametrize("text", ["<html><body>nothing</body></html>", "<table><tr><td>1</td></tr></table>", "<?xml?>"])
def test_pages_without_a_table_are_refused(log_file: Write, text: str) -> None:
    with pytest.raises(FlagdataError):
        read_log(log_file(text + "\n"))


def test_values_with_an_instant_of_their_own_are_none_of_the_reading(log_file: Write) -> None:
    readings = "".join(
        f'<period time-utc="2026-05-01T{12 + at}:00:00+00:00"><element units="m/s" type="wind_spd">{3 + at}</element>'
        f'<element units="deg" type="wind_dir">{210 + at}</element>'
        f'<element units="m/s" type="maximum_gust_spd" time-utc="2026-05-01T{12 + at}:43:00+00:00">{9 + at}</element>'
        "</period>"
        for at in range(6)
    )
    path = log_file(f'<?xml version="1.0"?><product><station name="A">{readings}</station></product>', "a.xml")
    check(path)
    told = [f.what for f in read_log(path).findings if f.kind == "other-instants"]
    assert len(told) == 1
    assert "maximum_gust_spd" in told[0]
