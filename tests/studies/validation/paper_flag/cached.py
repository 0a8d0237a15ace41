"""Intermediate results on disk, named by a hash of all that went in: a study that was interrupted
goes on from there.

What went in includes the source of the modules that computed it: a changed method never meets old
results. Each file ends with its checksum; a damaged one is computed anew, with a warning.
"""

from __future__ import annotations

import logging
from collections.abc import Callable, Mapping, Sequence
from io import BytesIO
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np

from flagdata.core.arrays import AnyArray
from flagdata.core.files.checksums import is_sealed, seal_bytes
from flagdata.core.files.outputs import rewrite
from flagdata.core.provenance import file_hash, recipe_hash

_LOG = logging.getLogger("flagdata")


def cached(
    folder: Path | None,
    inputs: Mapping[str, Any],
    method: Sequence[ModuleType],
    make: Callable[[], Mapping[str, AnyArray]],
) -> Mapping[str, AnyArray]:
    """The arrays that `make` returns, computed once for the same inputs and method.

    Args:
        folder: where they are cached; None caches nothing.
        inputs: everything that shapes the arrays, as JSON values.
        method: the modules whose source shapes them.
    """
    if folder is None:
        return make()
    source = {module.__name__: file_hash(Path(module.__file__ or "")) for module in method}
    target = folder / f"{recipe_hash({'inputs': dict(inputs), 'source': source})[:20]}.npz"
    if target.is_file():
        if is_sealed(target):
            with np.load(target) as stored:
                return {name: stored[name] for name in stored.files}
        _LOG.warning(
            "flagdata: warning: an intermediate result is damaged, or of an older version; it is "
            "computed anew"
            "\n  where: %s",
            target,
        )
    arrays = make()
    buffer = BytesIO()
    np.savez_compressed(buffer, **arrays)  # pyright: ignore[reportArgumentType]
    rewrite(target, seal_bytes(buffer.getvalue()))
    return arrays
