"""A log's file opened as text, whatever it is: a text, a topic of an MCAP file, a sheet, a netCDF
data set."""

from __future__ import annotations

from pathlib import Path

from flagdata.errors import LimitError, UsageError
from flagdata.ingest.anemometer.text.text_file import (
    NETCDF,
    TextFile,
    first_bytes,
    is_workbook,
    settle_text,
)
from flagdata.ingest.anemometer.wind_options import Limits
from flagdata.ingest.mcap.bags import is_bag


def open_text(
    path: Path, *, limits: Limits, encoding: str | None = None, topic: str | None = None
) -> TextFile:
    """Check a file against the limits and settle its encoding, in one pass over its bytes.

    Args:
        topic: of an MCAP file; `None` takes the only one that holds numbers.

    Raises:
        NotFoundError, InputError: see `first_bytes`; not text, or not in the encoding named.
        LimitError: larger than `limits` allow.
    """
    if is_bag(path):
        from flagdata.ingest.anemometer.containers import mcap_topic

        return mcap_topic.open_topic(path, topic, limits=limits)
    head = first_bytes(path)
    where = str(path)
    size = path.stat().st_size
    if size > limits.size:
        raise LimitError(
            f"the file has {size} bytes, more than {limits.size}",
            where=where,
            fix="split it",
        )
    if is_workbook(path, head):
        from flagdata.ingest.anemometer.containers import spreadsheet

        return spreadsheet.open_sheet(path, limits=limits)
    if head.startswith(NETCDF):
        from flagdata.ingest.anemometer.containers import netcdf

        return netcdf.open_dataset(path, limits=limits)
    if topic is not None:
        raise UsageError(
            "a topic was given, but this is no MCAP file", where=where, fix="leave out --topic"
        )
    return settle_text(path, head, limits=limits, encoding=encoding)
