"""Tables of thresholds as their authors wrote them."""

from __future__ import annotations

from pathlib import Path

import pytest

from flagdata.errors import InputError, NotFoundError
from tests.studies.validation.paper_flag.thresholds import (
    Threshold,
    authors_thresholds,
    digitised_curves,
    speeds_by_length,
)


def test_decimal_commas_are_read_and_zero_is_no_measurement(tmp_path: Path) -> None:
    path = tmp_path / "stop.csv"
    path.write_text('L,Ustop\n60,"15,71399"\n70,0\n80,"9,5"\n')
    assert speeds_by_length(path, column="Ustop") == (
        Threshold(length=0.06, speed=15.71399),
        Threshold(length=0.08, speed=9.5),
    )


def test_a_cell_that_is_no_number_is_named_by_its_line(tmp_path: Path) -> None:
    path = tmp_path / "stop.csv"
    path.write_text('L,Ustop\n60,"15,7"\n70,fast\n')
    with pytest.raises(InputError, match="line 3"):
        speeds_by_length(path, column="Ustop")
    with pytest.raises(InputError, match="Uonset"):
        speeds_by_length(path, column="Uonset")
    with pytest.raises(NotFoundError):
        speeds_by_length(tmp_path / "absent.csv", column="Ustop")


def test_the_authors_lengths_are_centimetres(tmp_path: Path) -> None:
    path = tmp_path / "thresholds.csv"
    path.write_text(
        ",Caso,f_bistable,f_flutter,U_bistable,U_flutter,L\n1,L1,10.2,16.8,5.7,10.6,15.5\n0,L0,11,16,7,10,13\n"
    )
    bistable, flutter = authors_thresholds(path)
    assert [t.length for t in bistable] == [0.13, 0.155]
    assert flutter[1] == Threshold(length=0.155, speed=10.6, frequency=16.8)


def test_digitised_curves_are_pairs_of_columns_of_unequal_length(tmp_path: Path) -> None:
    path = tmp_path / "curves.csv"
    path.write_text("first,,second,\nX,Y,X,Y\n0.1,9,1,5\n0.2,8,,\n")
    assert digitised_curves(path) == {"first": ((0.1, 9.0), (0.2, 8.0)), "second": ((1.0, 5.0),)}
