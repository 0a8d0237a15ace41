"""Types of arrays by their elements, and NumPy's archives of arrays (.npz), read where they unpack
to what can be held in memory."""

from __future__ import annotations

import zipfile
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from flagdata.errors import CorruptError, LimitError

FloatArray: TypeAlias = NDArray[np.float64]
IntArray: TypeAlias = NDArray[np.int64]
BoolArray: TypeAlias = NDArray[np.bool_]
UInt8Array: TypeAlias = NDArray[np.uint8]
Float32Array: TypeAlias = NDArray[np.float32]
AnyArray: TypeAlias = NDArray[Any]
HELD = 256 << 20
"""Most bytes that an archive may unpack to."""
EXPANSION = 20
"""Most times its own size that a larger archive may unpack to: numbers that were measured or
simulated take 1 to 3."""


def read_arrays(path: Path, *, what: str, fix: str) -> dict[str, AnyArray]:
    """Reads all arrays of an archive, by name.

    Args:
        what: that it is, at the beginning of a sentence.
        fix: what to do where it is damaged.

    Raises:
        FileNotFoundError: there is none.
        CorruptError: it cannot be read, or holds pickled objects.
        LimitError: it unpacks to more than `HELD` and `EXPANSION` allow.
    """
    where = str(path)
    try:
        with path.open("rb") as stream:
            with zipfile.ZipFile(stream) as archive:
                size = sum(entry.file_size for entry in archive.infolist())
            most = max(HELD, EXPANSION * path.stat().st_size)
            if size > most:
                raise LimitError(
                    f"{what} unpacks to {size} bytes",
                    where=where,
                    fix=f"at most {most} are read: {fix}",
                )
            stream.seek(0)
            with np.load(stream, allow_pickle=False) as content:
                return {name: np.asarray(content[name]) for name in content.files}
    except (LimitError, FileNotFoundError):
        raise
    except Exception as error:  # noqa: BLE001  zipfile, zlib, numpy: each its own kinds
        raise CorruptError(f"{what} cannot be read: {error}", where=where, fix=fix) from None
