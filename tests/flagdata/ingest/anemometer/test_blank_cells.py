"""Tables of crop models whose cells are blank keep their columns."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from flagdata.signals import WindLog

Read = Callable[..., WindLog]
HEAD = """*WEATHER DATA : MADE

@ INSI      LAT     LONG  ELEV   TAV   AMP REFHT WNDHT
  MADE    -12.5    -39.1   225    25 -99.0 -99.0 -99.0
@DATE  SRAD  TMAX  TMIN  RAIN  DEWP  WIND   PAR  RHUM
"""


def test_cells_are_cut_at_the_ends_of_the_names_above_them(read: Read) -> None:
    rows = "".join(f"96{day:03d}  21.8  32.4  22.1   0.0       {day / 10:5.1f}        71.2\n" for day in range(1, 31))
    log = read(HEAD + rows, unit="m/s", zone="UTC")
    np.testing.assert_allclose(log.series.channels["wind_speed"], np.arange(1, 31) / 10)
    assert str(np.datetime64(int(log.series.time[-1]), "ns"))[:10] == "1996-01-30"


def test_a_row_with_all_its_cells_among_them_is_read_as_well(read: Read) -> None:
    rows = "".join(f"96{day:03d}  21.8  32.4  22.1   0.0       {day / 10:5.1f}        71.2\n" for day in range(1, 31))
    full = "96031  21.8  32.4  22.1   0.0  12.0   9.9   5.1  71.2\n"
    log = read(HEAD + rows + full, unit="m/s", zone="UTC")
    assert log.series.channels["wind_speed"][-1] == 9.9
