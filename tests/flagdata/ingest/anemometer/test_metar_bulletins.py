"""METAR and SPECI reports in bulletins of the WMO's network: airfields are sites, the user gives the first day."""

from __future__ import annotations

import datetime as dt
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from flagdata.errors import TimeError
from flagdata.ingest.anemometer import WindOptions, anemometers, read_log
from flagdata.ingest.anemometer.sniff import sniff
from flagdata.timebase import iso

Write = Callable[[str], Path]

_BULLETINS = """
123

SAXX31 KAAA 301200 RRA

METAR

KAAA 301153Z AUTO 24005KT 10SM FEW040 21/12 A3001 RMK

     AO2 SLP120=

KBBB 301150Z VRB03KT CAVOK 20/11 Q1015=

124

FTXX31 KAAA 301130

TAF KAAA 301130Z 3012/0112 09009KT P6SM SKC=

125

SAXX32 EAAA 301220

METAR EAAA 301220Z 02010G18MPS 9999 SCT030 18/09 Q1012
    NOSIG=

METAR EBBB 301220Z NIL=

126

SPXX31 KAAA 010010

SPECI KAAA 010005Z 25012G20KT 5SM RA 20/13 A2999=

127

SAXX31 KAAA 301200 RRB

METAR KAAA 301153Z 24006KT 10SM FEW040 21/12 A3001=
METAR KAAA 302353Z 00000KT 10SM SKC 19/12 A3000=
"""


def test_the_day_is_asked_for_with_its_number(log_file: Write) -> None:
    with pytest.raises(TimeError, match="30") as caught:
        read_log(log_file(_BULLETINS))
    assert "--date YYYY-MM-30" in (caught.value.fix or "")


def test_the_day_of_the_files_name_is_offered(log_file: Write) -> None:
    path = log_file(_BULLETINS)
    named = path.rename(path.with_name("sa_20260430_1200.txt"))
    with pytest.raises(TimeError) as caught:
        read_log(named)
    assert "--date 2026-04-30" in (caught.value.fix or "")


def test_another_day_than_the_first_reports_is_refused(log_file: Write, day: Callable[[str], WindOptions]) -> None:
    with pytest.raises(TimeError, match="day 30"):
        read_log(log_file(_BULLETINS), day("2026-04-29"))


def test_airfields_are_sites_in_the_order_of_time_over_the_end_of_a_month(
    log_file: Write, day: Callable[[str], WindOptions]
) -> None:
    path = log_file(_BULLETINS)
    assert anemometers(path, day("2026-04-30")) == ("EAAA", "KAAA", "KBBB")
    log = read_log(path, day("2026-04-30:KAAA"))
    stamps = [iso(int(at))[:16] for at in log.series.time]
    assert stamps == ["2026-04-30T11:53", "2026-04-30T23:53", "2026-05-01T00:05"]
    assert log.series.channels["wind_speed"].tolist() == pytest.approx([6 * 1852 / 3600, 0, 12 * 1852 / 3600])
    degrees = np.degrees(log.series.channels["wind_direction"])
    assert degrees[[0, 2]].tolist() == pytest.approx([240, 250])
    assert np.isnan(degrees[1])
    assert [finding.count for finding in log.findings if finding.kind == "repeated-messages"] == [1]


def test_a_report_goes_on_in_the_next_line_and_states_its_own_unit(
    log_file: Write, day: Callable[[str], WindOptions]
) -> None:
    text = (
        "SAXX31 EAAA 301220\n\nMETAR EAAA 301220Z 02010G18MPS 9999\n  SCT030=\n\nMETAR EAAA 301250Z 03008MPS CAVOK=\n"
    )
    series = read_log(log_file(text), day("2026-04-30")).series
    assert series.channels["wind_speed"].tolist() == [10, 8]
    assert np.degrees(series.channels["wind_direction"]).tolist() == pytest.approx([20, 30])


@pytest.fixture
def day() -> Callable[[str], WindOptions]:
    """Options with a date, and with the label of an airfield behind a colon."""

    def options(text: str) -> WindOptions:
        date, _, wind = text.partition(":")
        return WindOptions(date=dt.date.fromisoformat(date), wind=wind or None)

    return options


def test_a_sniff_asks_for_the_date_of_bulletins(log_file: Write) -> None:
    """It read them by a date of its own, which is none of theirs."""
    (guess, *_) = sniff(log_file(_BULLETINS))
    assert guess.needs[0].endswith("--date YYYY-MM-30")
    assert guess.draft is None
    assert not any("2000" in text for text in (*guess.reasons, *guess.notes, *guess.needs))
