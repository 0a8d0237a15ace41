"""Entries of a model's card that a study measured: read here, in one way, wherever they are
used."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any, TypeVar

from flagdata.core.shell import command_line
from flagdata.errors import CorruptError, InputError

if TYPE_CHECKING:
    from models.trained.estimator import Estimator

Entry = TypeVar("Entry")


def card_entry(
    model: Estimator, key: str, of_entry: Callable[[Mapping[str, Any]], Entry], *, study: str
) -> Entry | None:
    """Reads an entry of a model's card; None where the card has none.

    Args:
        key: of the entry.
        of_entry: makes it of the card's values; raises KeyError, TypeError, ValueError or
            InputError where it cannot.
        study: that measures it, as in `python -m tests.studies STUDY`.

    Raises:
        CorruptError: the entry is damaged.
    """
    values: Any = model.card.get(key)
    if values is None:
        return None
    try:
        return of_entry(values)
    except (KeyError, TypeError, ValueError, InputError) as error:
        raise CorruptError(
            f"the card's {key} cannot be used: {error}",
            where=f"model {model.name!r}",
            fix="measure it anew, in a checkout of flagdata: "
            + command_line("python", "-m", "tests.studies", study),
        ) from None
