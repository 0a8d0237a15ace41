"""No column of a table is dropped unsaid: what is read for nothing is named, whatever its heading."""

from collections.abc import Callable
from pathlib import Path

import numpy as np

from flagdata.ingest.anemometer.log import read_log
from flagdata.ingest.anemometer.options import WindOptions

Write = Callable[[str], Path]


def _not_read(log_file: Write, text: str, **options: object) -> list[str]:
    log = read_log(log_file(text), WindOptions(zone="UTC", **options))  # type: ignore[arg-type]
    return [finding.what for finding in log.findings if finding.kind == "columns-not-read"]


def _table(names: str, cells: str) -> str:
    rows = "".join(f"2026-05-01 12:00:{at:02d},{3 + at % 4}.5,{200 + at % 7},{cells}\n" for at in range(30))
    return f"time,wind speed (m/s),wind direction,{names}\n{rows}"


def test_columns_with_any_heading_are_named(log_file: Write) -> None:
    found = _not_read(log_file, _table("zeta,Qx7,", "181.5,abc,4"))
    assert found == ["columns 'zeta', 'Qx7', number 6 are not read"]


def test_a_column_that_another_message_names_and_an_empty_one_are_not_named_again(log_file: Write) -> None:
    (found,) = _not_read(log_file, _table("wind gust (m/s),zeta,void", "9.5,1,"))
    assert found.startswith("column 'wind gust (m/s)' speaks of the wind")
    assert found.endswith("; column 'zeta' is not read")
    assert "void" not in found


def test_nothing_is_said_where_every_column_is_read(log_file: Write) -> None:
    text = _table("air temperature (°C)", "14.25")
    assert _not_read(log_file, text) == []
    log = read_log(log_file(text), WindOptions(zone="UTC"))
    np.testing.assert_allclose(log.series.channels["air_temperature"], 287.4, rtol=1e-6)


def test_of_many_columns_forty_are_named_and_the_others_counted(log_file: Write) -> None:
    names = ",".join(f"q{at}x" for at in range(50))
    (found,) = _not_read(log_file, _table(names, ",".join("1" * 50)))
    assert "'q39x' and 10 more are not read" in found
    assert "'q40x'" not in found
