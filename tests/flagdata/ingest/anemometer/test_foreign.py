"""Texts that are no table of a wind, each told by its own lines, with what their user can do."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from flagdata.ingest.anemometer import sniff

Write = Callable[..., Path]
PROFILER = """
CBY
WINDS     rev 5.1
  43.10 -70.50    20
 21 03 14 05 00 00     0
  60     5    10
   HT     SPD    DIR
  0.146   3.2    245
  0.205   4.1    250
$
"""


@pytest.mark.parametrize(
    ("text", "kind"),
    [
        (PROFILER, "wind profiles"),
        ("".join(f".A KSEA 202603{day:02d} Z DH0500/US 4.1/UD 199\n" for day in range(1, 9)), "SHEF"),
        ("STN YYMMDD/HHMM UWND VWND\n725300 260314/0500 3.2 1.1\n725300 260314/0600 3.4 1.0\n", "BUFKIT"),
        ("SNPARM = PRES;TMPC\nSTNPRM = SHOW\n\nSTID = KSEA STNM = 727930 TIME = 260314/0500\n", "BUFKIT"),
    ],
)
def test_it_is_told_what_it_is_and_what_to_do(log_file: Write, text: str, kind: str) -> None:
    (guess,) = sniff(log_file(text))
    assert (guess.format, guess.kind) == (kind, "other")
    assert guess.fix
