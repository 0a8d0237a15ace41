"""Elements of the wind in daily summaries of NOAA, and the words they stand for.

Source: NOAA NCEI, "Global Historical Climatology Network - Daily, documentation", table of elements. The files
themselves are in tenths of m/s; exports of "Daily Summaries" are in mph (standard) or m/s (metric), and do not say.
"""

from __future__ import annotations

_FASTEST = {
    "1": "1 min maximum", "2": "2 min maximum", "5": "5 sec maximum", "G": "peak gust", "I": "instantaneous maximum",
    "M": "mile maximum",
}  # fmt: skip
ELEMENTS = {
    "AWND": "mean wind speed", "AWDR": "mean wind direction", "FMTM": "maximum mile time", "PGTM": "peak gust time",
    **{f"WSF{mark}": f"{words} wind speed" for mark, words in _FASTEST.items()},
    **{f"WDF{mark}": f"{words} wind direction" for mark, words in _FASTEST.items()},
}  # fmt: skip
"""Names of columns and the same in words."""
UNITS = "--unit mph or --unit m/s, as the export was ordered, or --unit '0.1 m/s' of GHCN-Daily's own files"
"""How the user says the unit of these elements."""
