"""Whether a store keeps the conditions of puts, on which every commit relies.

Some servers take `If-None-Match` and `If-Match` and ignore them: of two writers at one version both would win, and a
commit would be lost without a word.
"""

from __future__ import annotations

import uuid
from functools import cache

from flagdata.errors import FlagdataError, RefusedError
from flagdata.storage import RemotePath, StoreError
from flagdata.storage.refusals import DeniedError


@cache
def probe(folder: RemotePath) -> None:
    """Put one object twice in `folder`, each time only if its name is free, and replace it by a version it has not:
    once a process and folder.

    Raises:
        RefusedError: the store did what it was asked not to do.
        FlagdataError: it cannot be written to.
    """
    place = folder / f"probe-{uuid.uuid4().hex}"
    try:
        first = place.create(b"1")
        twice = place.create(b"2")
        swapped = place.replace_if('"00000000000000000000000000000000"', b"3") is not None
        there = place.read_bytes()
        place.unlink()
    except DeniedError as error:
        raise FlagdataError(
            f"this lake can be read, but not written: {error.strerror}", where=str(folder.parent), fix=error.fix
        ) from None
    except StoreError as error:
        raise FlagdataError(
            f"this lake cannot be written: {error.strerror}",
            where=str(folder.parent),
            fix=f"{error.fix}, then try again",
        ) from None
    if not first or twice or swapped or there != b"1":
        raise RefusedError(
            "the store ignores the conditions of puts, so that writers would lose each other's commits",
            where=str(folder.parent),
            fix="use a store that keeps If-None-Match and If-Match (S3 itself does), or a lake in a local folder",
        )
