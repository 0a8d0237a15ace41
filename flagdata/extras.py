"""What a plain installation leaves out: the extra that brings each module, and the error of one that is missing."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

from flagdata.errors import MissingExtraError

EXTRAS = {
    "torch": "physics",
    "cv2": "physics",
    "safetensors": "physics",
    "matplotlib": "physics",
    "sklearn": "learn",
    "psutil": "learn",
    "dask": "cluster",
    "distributed": "cluster",
    "xarray": "xarray",
    "warp": "gpu",
}
"""Module → extra of pyproject.toml. Excel sheets and object storage name theirs where they are opened."""
_CPU = "without an NVIDIA card first: pip install torch --index-url https://download.pytorch.org/whl/cpu; then: "


def missing(error: ImportError) -> MissingExtraError | None:
    """Returns the error for the user of a module that is not installed; None where no extra brings it."""
    module = (error.name or "").partition(".")[0]
    if not isinstance(error, ModuleNotFoundError) or module not in EXTRAS:
        return None
    extra = EXTRAS[module]
    first = "" if extra in ("xarray", "gpu") else _CPU
    return MissingExtraError(
        f"this needs {module}, which the plain installation leaves out", fix=f"{first}pip install 'flagdata[{extra}]'"
    )


@contextmanager
def explained() -> Iterator[None]:
    """Turns the missing of a module that an extra brings into an error that names the extra.

    Raises:
        MissingExtraError: so it is.
    """
    try:
        yield
    except ImportError as error:
        extra_error = missing(error)
        if extra_error is None:
            raise
        raise extra_error from error
