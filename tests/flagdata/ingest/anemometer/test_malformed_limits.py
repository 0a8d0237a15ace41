"""Files beyond the limits: an error with place and fix, or samples flagged and findings with
numbers."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from flagdata.errors import LimitError
from flagdata.ingest import read_log
from flagdata.ingest.anemometer import Limits
from tests.flagdata.ingest.anemometer.cases import GOOD, ROW, case, csv, stamped
from tests.flagdata.ingest.anemometer.conftest import check_refused

REFUSED = [
    case(
        "rows",
        content=stamped(*GOOD),
        error=LimitError,
        says="10 lines",
        options={"limits": Limits(rows=10)},
    ),
    case(
        "bytes",
        content=stamped(*GOOD),
        error=LimitError,
        says="100",
        options={"limits": Limits(size=100)},
    ),
    case("line", content=csv(ROW + "0" * 70000), error=LimitError, where="line 2", says="65536"),
    case("line-without-end", content=csv(ROW) + b"9" * 3000000, error=LimitError, where="line 3"),
    case("one-line-of-commas", content=b"," * 100000, error=LimitError),
]


@pytest.mark.parametrize("case", REFUSED)
def test_what_cannot_be_read_is_refused_with_place_and_fix(case: dict[str, Any]) -> None:
    check_refused(**case)


def test_a_file_beyond_the_size_limit_is_refused_without_being_read(tmp_path: Path) -> None:
    path = tmp_path / "huge.csv"
    with path.open("wb") as stream:
        stream.write(csv(ROW))
        stream.truncate(3 * 1024**3)  # sparse: takes no space
    with pytest.raises(LimitError, match="more than 2147483648"):
        read_log(path)
