"""Imports of optional libraries, with what to do where one is missing."""

from __future__ import annotations

import importlib
import warnings
from types import ModuleType

from flagdata.errors import InputError


def library(module: str, *, of: str) -> ModuleType:
    """A module of an optional library.

    gpytorch's imports call a function of torch that newer versions call deprecated; that warning is
    theirs.

    Args:
        module: to import.
        of: the distribution it belongs to, for the message.

    Raises:
        InputError: it is not installed.
    """
    try:
        with warnings.catch_warnings():
            warnings.filterwarnings("ignore", category=DeprecationWarning)
            return importlib.import_module(module)
    except ModuleNotFoundError as error:
        raise InputError(
            f"{error.name} is not installed, which this optimiser needs",
            where=of,
            fix='pip install "flagdata[dev]"',
        ) from None
