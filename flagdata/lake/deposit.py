"""Objects that one process puts into the store for another, which commits the rows that refer to
them."""

from __future__ import annotations

import shutil
import uuid
from collections.abc import Callable
from contextlib import closing
from dataclasses import dataclass
from pathlib import Path

from flagdata.core.files.checksums import files_of
from flagdata.core.files.durable import disk_errors
from flagdata.lake.leases import Lease
from flagdata.lake.store import Store


@dataclass(frozen=True, kw_only=True)
class Deposit:
    """An object in the store to which no row refers yet.

    Attributes:
        name: of the object.
        fresh: whether a whole object is there now that was not before.
    """

    name: str
    fresh: bool


def deposit(lake: Store, suffix: str, write: Callable[[Path], object]) -> Deposit:
    """Puts an object into the store; `Transaction.rely` takes it over, in this process or another.

    Until then a collection may take it once it is older than the grace.

    Args:
        suffix: ".mcap" or ".zarr".
        write: called with the path at which the file or folder is to be written.

    Raises:
        InputError: what was written is empty.
        FlagdataError: no space, no permission.
    """
    with disk_errors("storing an object", lake.path), closing(Lease(lake.staging)) as lease:
        path = lease.folder / f"{uuid.uuid4().hex}{suffix}"
        write(path)
        name = lake.objects.name_of(path)
        lease.hold(name)
        return Deposit(name=name, fresh=lake.objects.publish(path, name))


def copy_object(source: Path, target: Path) -> None:
    """Copy the file or folder of an object, without modes: what is read-only could be neither moved
    nor collected.

    Raises:
        InputError: there is none, or it holds a link.
        OSError: what the disk refused.
    """
    files = files_of(source)
    if source.is_dir():
        target.mkdir()
    for file in files:
        copied = target / file.relative_to(source)
        copied.parent.mkdir(parents=True, exist_ok=True)
        shutil.copyfile(file, copied)
