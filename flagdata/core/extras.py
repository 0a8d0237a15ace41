"""What a plain installation leaves out: the extra that brings each module, and the error of one
that is missing."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from importlib.util import find_spec

from flagdata.core.shell import command_line
from flagdata.errors import MissingExtraError

EXTRAS = {
    "torch": "physics",
    "cv2": "physics",
    "safetensors": "physics",
    "matplotlib": "plots",
    "psutil": "learn",
    "dask": "cluster",
    "distributed": "cluster",
    "xarray": "xarray",
    "warp": "gpu",
}
"""Module → extra of pyproject.toml. Excel sheets and object storage name theirs where they are
opened."""
PURPOSES = {
    "physics": "measuring, simulating and training pairs need",
    "learn": "training and evaluating networks need",
    "cluster": "the workers of a scheduler need",
    "plots": "figures need",
    "xarray": "Zarr and NetCDF files need",
    "gpu": "simulations on a graphics processor need",
}
"""What each extra is for, as the begin of a sentence."""
_TORCH = "torch"
_OF_TORCH = frozenset({"physics", "learn", "cluster"})
"""Extras that bring torch."""
_CPU = (
    "without an NVIDIA card first: pip install torch --index-url "
    "https://download.pytorch.org/whl/cpu; then: "
)


def missing(error: ImportError) -> MissingExtraError | None:
    """Returns the error for the user of a module that is not installed; None where no extra brings
    it."""
    module = (error.name or "").partition(".")[0]
    if not isinstance(error, ModuleNotFoundError) or module not in EXTRAS:
        return None
    extra = EXTRAS[module]
    first = _CPU if extra in _OF_TORCH and not _is_installed(_TORCH) else ""
    return MissingExtraError(
        f"{PURPOSES[extra]} {module}, which is not installed",
        fix=first + command_line("pip", "install", f"flagdata[{extra}]"),
    )


def _is_installed(module: str) -> bool:
    try:
        return find_spec(module) is not None
    except (ImportError, ValueError):
        return False


@contextmanager
def explaining_missing() -> Iterator[None]:
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
