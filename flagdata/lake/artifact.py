"""One row of the catalog, typed, with the identity that makes ingest idempotent."""

from __future__ import annotations

import dataclasses
import math
import operator
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from datetime import UTC, datetime
from functools import cached_property
from typing import Any

import pyarrow as pa

from flagdata.core import provenance
from flagdata.core.schema import CATALOG, FORMAT_VERSION, Kind
from flagdata.errors import CorruptError, InputError
from flagdata.recipes.documents import from_stored_json

OBJECT_NAME = re.compile(r"(mcap|zarr|model)/[0-9a-f]{64}")
ARTIFACT_ID = re.compile(r"[0-9a-f]{32}")
_SHA256 = re.compile(r"[0-9a-f]{64}")
_DERIVED = ("artifact", "recipe", "recipe_hash", "format_version")
_INTEGERS = [
    name for name, f in CATALOG.items() if pa.types.is_integer(f.type) and name not in _DERIVED
]
_NUMBERS = [name for name, f in CATALOG.items() if pa.types.is_floating(f.type)]
_TEXTS = [
    name for name, f in CATALOG.items() if pa.types.is_string(f.type) and name not in _DERIVED
]
_JSON_COLUMNS = ("parameters", "clock_model", "report")


def _is_unicode(text: str) -> bool:
    try:
        text.encode()
    except UnicodeEncodeError:  # half of a surrogate pair: a file name in another encoding
        return False
    return True


@dataclass(frozen=True, kw_only=True)
class Artifact:
    """What a catalog row says; fields are the columns of `schema.CATALOG`, where units and meanings
    are.

    `recipe` is given as a mapping; `id` (column `artifact`) and `recipe_hash` are derived.
    `parameters`, `clock_model` and `report` are JSON texts. `branch` and `created` are set by the
    transaction that publishes the row.

    Raises:
        InputError: a value that is malformed, naming the column.
    """

    kind: Kind
    name: str
    branch: str = "main"
    object: str | None = None
    object_bytes: int | None = None
    source_hash: str | None = None
    source_name: str | None = None
    parents: Sequence[str] = ()
    recipe: Mapping[str, Any] = field(default_factory=dict)
    code_version: str = field(default_factory=lambda: provenance.code_version())
    format_version: int = FORMAT_VERSION
    seed: int | None = None
    created: datetime | None = None
    recording: str | None = None
    session: str | None = None
    dataset: str | None = None
    side: str | None = None
    day: str | None = None
    start: int | None = None
    end: int | None = None
    frame_first: int | None = None
    frame_count: int | None = None
    rate: float | None = None
    wind: float | None = None
    wind_sigma: float | None = None
    wind_coverage: float | None = None
    wind_staleness: float | None = None
    clock_method: str | None = None
    clock_offset: float | None = None
    clock_drift: float | None = None
    clock_sigma: float | None = None
    clock_model: str | None = None
    parameters: str | None = None
    quality: Sequence[str] = ()
    report: str | None = None

    def __post_init__(self) -> None:
        self._check_types()
        if self.kind not in list(Kind):
            raise self._bad("kind", self.kind, f"one of {', '.join(Kind)}")
        object.__setattr__(self, "kind", Kind(self.kind))
        object.__setattr__(self, "parents", tuple(self.parents))
        object.__setattr__(self, "quality", tuple(self.quality))
        if not self.name.strip() or not self.name.isprintable():
            raise self._bad("name", self.name, "a name people can recognise it by")
        if self.object is not None and not OBJECT_NAME.fullmatch(self.object):
            raise self._bad("object", self.object, "what Transaction.put returned")
        for parent in (*self.parents, *([self.recording] if self.recording else [])):
            if not ARTIFACT_ID.fullmatch(parent):
                raise self._bad("parents", parent, "full artifact ids (32 hexadecimal digits)")
        if self.source_hash is not None and not _SHA256.fullmatch(self.source_hash):
            raise self._bad("source_hash", self.source_hash, "a SHA-256 in hexadecimal")
        if (self.dataset is None) != (self.side is None):
            raise self._bad("side", self.side, "a data set and its side, both or neither")
        if self.start is not None and self.end is not None and self.end < self.start:
            raise self._bad("end", self.end, "an instant that is not before the start")
        for column in ("object_bytes", "frame_first", "frame_count"):
            value = getattr(self, column)
            if value is not None and value < 0:
                raise self._bad(column, value, "a number that is not negative")
        for column in _JSON_COLUMNS:
            text = getattr(self, column)
            if text is not None:
                try:
                    from_stored_json(text)
                except (TypeError, ValueError) as error:
                    raise self._bad(column, str(error), "JSON text") from None

    def _check_types(self) -> None:
        """Numbers of other libraries become Python's; what the catalog's column cannot hold is
        refused."""
        for column in _INTEGERS:
            value = getattr(self, column)
            if value is not None:
                if not hasattr(value, "__index__") or not -(2**63) <= operator.index(value) < 2**63:
                    raise self._bad(column, value, "a whole number of at most 64 bits")
                object.__setattr__(self, column, operator.index(value))
        for column in _NUMBERS:
            value = getattr(self, column)
            if value is not None:
                if (
                    isinstance(value, str)
                    or not hasattr(value, "__float__")
                    or not math.isfinite(value)
                ):
                    raise self._bad(column, value, "a finite number, or None where it is not known")
                object.__setattr__(self, column, float(value))
        for column in _TEXTS:
            value = getattr(self, column)
            if value is not None and not (isinstance(value, str) and _is_unicode(value)):
                raise self._bad(column, value, "text in Unicode")

    def _bad(self, column: str, value: object, wanted: str) -> InputError:
        return InputError(
            f"{column} is {value!r}", where=f"artifact {self.name!r}", fix=f"give {wanted}"
        )

    @cached_property
    def recipe_hash(self) -> str:
        """SHA-256 of the recipe's canonical JSON."""
        return provenance.recipe_hash(self.recipe)

    @cached_property
    def id(self) -> str:
        """Identity: what went in and what it is a part of; 32 hexadecimal digits of a SHA-256.

        Neither the object's bytes nor the code version take part: the same source under the same
        recipe is the same artifact, so that ingesting it again finds it. A result that is revised
        states so in its recipe, see `flagdata.lake.results`.
        """
        identity = {
            "kind": self.kind.value,
            "parents": list(self.parents),
            "source_hash": self.source_hash,
            "recipe_hash": self.recipe_hash,
            "frame_first": self.frame_first,
            "frame_count": self.frame_count,
            "seed": self.seed,
        }
        return provenance.digest(provenance.canonical(identity))[:32]

    def row(self) -> dict[str, Any]:
        """Values by catalog column; instants as int64, lists as lists."""
        values = {f.name: getattr(self, f.name) for f in dataclasses.fields(self)}
        values.update(
            artifact=self.id,
            kind=self.kind.value,
            parents=list(self.parents),
            quality=list(self.quality),
            recipe=provenance.canonical(self.recipe),
            recipe_hash=self.recipe_hash,
            created=self.created or datetime.now(UTC),
        )
        return {column: values[column] for column in CATALOG}

    @classmethod
    def from_row(cls, row: Mapping[str, Any]) -> Artifact:
        """Builds the artifact of a catalog row (the inverse of `row`).

        Raises:
            InputError: a row whose values break the rules above.
            CorruptError: a row whose identity is not that of its content, or that lacks what each
                row has.
        """
        names = {f.name for f in dataclasses.fields(cls)}
        values = {column: value for column, value in row.items() if column in names}
        try:
            values["recipe"] = from_stored_json(row["recipe"]) if row.get("recipe") else {}
            artifact = cls(**values)
        except (TypeError, ValueError, AttributeError) as error:
            raise CorruptError(
                f"the row of {row['artifact']} is damaged: {error}",
                where=f"artifact {row.get('name')!r}",
                fix="run flagdata doctor",
            ) from None
        if artifact.id != row["artifact"]:
            raise CorruptError(
                f"the row of {row['artifact']} describes another artifact, {artifact.id}",
                where=f"artifact {artifact.name!r}",
                fix="run flagdata doctor",
            )
        return artifact
