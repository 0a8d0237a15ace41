"""Abbreviations of time zones: what each may mean. None is the name of a zone, and many are of several."""

from __future__ import annotations

from collections.abc import Mapping
from datetime import UTC, datetime, timedelta
from functools import cache
from zoneinfo import ZoneInfo, available_timezones

_PLACES = (
    "Europe/Amsterdam",
    "Europe/London",
    "Europe/Lisbon",
    "Europe/Athens",
    "Europe/Moscow",
    "America/New_York",
    "America/Chicago",
    "America/Denver",
    "America/Los_Angeles",
    "America/Anchorage",
    "Pacific/Honolulu",
    "America/Halifax",
    "America/St_Johns",
    "Asia/Kolkata",
    "Europe/Dublin",
    "Asia/Jerusalem",
    "Asia/Shanghai",
    "Asia/Tokyo",
    "Asia/Seoul",
    "Australia/Sydney",
    "Australia/Adelaide",
    "Australia/Perth",
    "Pacific/Auckland",
    "Africa/Johannesburg",
    "Africa/Lagos",
    "Africa/Nairobi",
    "Pacific/Pago_Pago",
)
"""Places that are named rather than others of the same clock."""
_ELSEWHERE: Mapping[str, Mapping[str, str]] = {
    "MEZ": {"+01:00": "Europe/Berlin"},
    "MESZ": {"+02:00": "Europe/Berlin"},
    "MET": {"+01:00": "Europe/Amsterdam"},
    "MEST": {"+02:00": "Europe/Amsterdam"},
    "HNEC": {"+01:00": "Europe/Paris"},
    "HAEC": {"+02:00": "Europe/Paris"},
    "ET": {"-05:00": "America/New_York", "-04:00": "America/New_York"},
    "CT": {"-06:00": "America/Chicago", "-05:00": "America/Chicago"},
    "MT": {"-07:00": "America/Denver", "-06:00": "America/Denver"},
    "PT": {"-08:00": "America/Los_Angeles", "-07:00": "America/Los_Angeles"},
    "BRT": {"-03:00": "America/Sao_Paulo"},
    "BRST": {"-02:00": "America/Sao_Paulo"},
    "ART": {"-03:00": "America/Argentina/Buenos_Aires"},
    "CLT": {"-04:00": "America/Santiago"},
    "CLST": {"-03:00": "America/Santiago"},
    "COT": {"-05:00": "America/Bogota"},
    "PET": {"-05:00": "America/Lima"},
    "VET": {"-04:00": "America/Caracas"},
    "UYT": {"-03:00": "America/Montevideo"},
    "ECT": {"-05:00": "America/Guayaquil"},
    "AMT": {"-04:00": "America/Manaus", "+04:00": "Asia/Yerevan"},
    "AST": {"+03:00": "Asia/Riyadh"},
    "BST": {"+06:00": "Asia/Dhaka"},
    "GST": {"+04:00": "Asia/Dubai"},
    "IRST": {"+03:30": "Asia/Tehran"},
    "TRT": {"+03:00": "Europe/Istanbul"},
    "UZT": {"+05:00": "Asia/Tashkent"},
    "NPT": {"+05:45": "Asia/Kathmandu"},
    "ICT": {"+07:00": "Asia/Bangkok"},
    "SGT": {"+08:00": "Asia/Singapore"},
    "SST": {"+08:00": "Asia/Singapore"},
    "MYT": {"+08:00": "Asia/Kuala_Lumpur"},
    "PHT": {"+08:00": "Asia/Manila"},
    "WST": {"+08:00": "Australia/Perth", "+13:00": "Pacific/Apia"},
    "CHST": {"+10:00": "Pacific/Guam"},
    "EST": {"+10:00": "Australia/Brisbane"},
    "FET": {"+03:00": "Europe/Minsk"},
    "SAMT": {"+04:00": "Europe/Samara"},
}
"""Abbreviations in use that the tz database does not have, or not for these places."""


def meanings(abbreviation: str) -> dict[str, str]:
    """Offset from UTC ("+02:00") → a place whose clocks are called so at that offset; empty for no abbreviation."""
    name = abbreviation.strip().upper()
    return {**_called().get(name, {}), **_ELSEWHERE.get(name, {})}


@cache
def _called() -> dict[str, dict[str, str]]:
    """What clocks of this year are called → their offset → the first place, by the tz database."""
    found: dict[str, dict[str, str]] = {}
    middle = datetime.now(UTC).replace(day=15)
    for place in (*_PLACES, *sorted(name for name in available_timezones() if "/" in name)):
        for month in (1, 7):
            clock = middle.replace(month=month).astimezone(ZoneInfo(place))
            name = (clock.tzname() or "").upper()
            if name.isalpha() and name not in ("UTC", "GMT"):
                found.setdefault(name, {}).setdefault(_written(clock.utcoffset() or timedelta()), place)
    return found


def _written(offset: timedelta) -> str:
    minutes = round(offset.total_seconds() / 60)
    return f"{'-' if minutes < 0 else '+'}{abs(minutes) // 60:02d}:{abs(minutes) % 60:02d}"
