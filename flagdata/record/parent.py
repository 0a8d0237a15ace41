"""Opening a stored record that something new is made of, so that no damage in it gets a sound hash
of its own."""

from __future__ import annotations

from typing import TYPE_CHECKING

from flagdata.record.reader import Record

if TYPE_CHECKING:
    from flagdata.lake import Lake


def open_parent(lake: Lake, name: str) -> Record:
    """Opens the record stored as `name` ("mcap/…"), of which all that is read is checked.

    A record with checksums checks each part as it is read. One that was written before there were
    any is hashed whole.

    Raises:
        NotFoundError: it is not there.
        CorruptError: not a whole record, or, without checksums, not what its name says.
    """
    record = Record.open(lake.object_path(name))
    if not record.has_checksums:
        lake.whole_object(name)
    return record
