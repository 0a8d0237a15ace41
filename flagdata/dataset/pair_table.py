"""What a resolved query hands to loader workers: flat numpy arrays, one entry a pair; no catalog,
no connection."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields, replace
from typing import Any, Self

import numpy as np
import pyarrow as pa
from numpy.typing import NDArray

from flagdata.core.arrays import AnyArray, BoolArray, FloatArray, IntArray
from flagdata.errors import CorruptError
from flagdata.recipes.documents import column_json

# Columns of the catalog that a pair is made of.
COLUMNS = (
    "artifact",
    "recording",
    "session",
    "day",
    "seed",
    "object",
    "frame_first",
    "frame_count",
    "start",
    "end",
    "wind",
    "wind_sigma",
    "wind_coverage",
    "wind_staleness",
    "clock_sigma",
    "parameters",
    "recipe",
)


@dataclass(frozen=True, kw_only=True, eq=False)
class PairTable:
    """Pairs in order; arrays of length n unless said otherwise.

    Attributes:
        artifact, recording, session, day: identities as in `Sample`; "" where the catalog has null.
        seed: root seed; meaningless where `seeded` is false.
        seeded: whether the clip is simulated.
        object: index into `objects`.
        objects: (m,) names of the objects that hold the clips.
        frame_first, frame_count: the clip's frames in its object.
        start, end: [UTC ns].
        wind, wind_sigma: [m/s]; NaN where unknown.
        coverage: share of the window.
        staleness: [s], infinite where there is no sample.
        clock_sigma: [s], NaN where unknown.
        parameters: (n, p) values of `names`, NaN where a clip has no such parameter.
        names: (p,) parameter names; those of nested parameters are joined by dots.
    """

    artifact: NDArray[np.str_]
    recording: NDArray[np.str_]
    session: NDArray[np.str_]
    day: NDArray[np.str_]
    seed: IntArray
    seeded: BoolArray
    object: IntArray
    objects: NDArray[np.str_]
    frame_first: IntArray
    frame_count: IntArray
    start: IntArray
    end: IntArray
    wind: FloatArray
    wind_sigma: FloatArray
    coverage: FloatArray
    staleness: FloatArray
    clock_sigma: FloatArray
    parameters: FloatArray
    names: NDArray[np.str_]

    def __len__(self) -> int:
        return len(self.artifact)

    @classmethod
    def of(cls, rows: pa.Table, *, labels: Mapping[str, Mapping[str, Any]] | None = None) -> Self:
        """Builds the table of catalog rows (with at least `COLUMNS`), in the order of recording,
        frame and identity.

        Args:
            labels: artifact → the user's own values; those that are numbers or truth values become
                the parameters "label.<name>".

        Raises:
            CorruptError: a clip without its object or frames.
        """
        rows = rows.sort_by(
            [("recording", "ascending"), ("frame_first", "ascending"), ("artifact", "ascending")]
        )
        for column in ("object", "frame_first", "frame_count", "start", "end"):
            if rows[column].null_count:
                artifact = rows.filter(rows[column].is_null())["artifact"][0].as_py()
                raise CorruptError(
                    f"a clip has no {column}",
                    where=f"artifact {artifact}",
                    fix="run flagdata doctor",
                )
        objects, index = _encode_column(rows, "object")
        ids = rows["artifact"].to_pylist()
        texts = rows["parameters"].to_pylist()
        if labels:
            texts = [
                _add_labels(text, labels.get(i), artifact=i)
                for text, i in zip(texts, ids, strict=True)
            ]
        parameters, names = _parameters(texts, ids)
        return cls(
            artifact=_text(rows, "artifact"),
            recording=_text(rows, "recording"),
            session=_text(rows, "session"),
            day=_text(rows, "day"),
            seed=rows["seed"].fill_null(0).to_numpy().astype(np.int64),
            seeded=rows["seed"].is_valid().to_numpy().astype(np.bool_),
            object=index,
            objects=objects,
            frame_first=rows["frame_first"].to_numpy().astype(np.int64),
            frame_count=rows["frame_count"].to_numpy().astype(np.int64),
            start=rows["start"].to_numpy().astype(np.int64),
            end=rows["end"].to_numpy().astype(np.int64),
            wind=_number(rows, "wind", null=np.nan),
            wind_sigma=_number(rows, "wind_sigma", null=np.nan),
            coverage=_number(rows, "wind_coverage", null=0.0),
            staleness=_number(rows, "wind_staleness", null=np.inf),
            clock_sigma=_number(rows, "clock_sigma", null=np.nan),
            parameters=parameters,
            names=names,
        )

    def take(self, index: IntArray | BoolArray) -> Self:
        """Selects the pairs at `index`, in its order, with the objects and parameter names that
        they use."""
        shared = ("objects", "names")
        taken = {f.name: getattr(self, f.name)[index] for f in fields(self) if f.name not in shared}
        used, taken["object"] = np.unique(taken["object"], return_inverse=True)
        has_values = ~np.all(np.isnan(taken["parameters"]), axis=0)
        taken["parameters"] = taken["parameters"][:, has_values]
        return replace(self, **taken, objects=self.objects[used], names=self.names[has_values])

    def parameter_columns(
        self, rows: IntArray | Sequence[int] | slice = slice(None)
    ) -> dict[str, FloatArray]:
        """Name → (n,) values of some pairs, by default of all; NaN where a clip has no such
        parameter."""
        chosen = self.parameters[rows]
        return {str(name): chosen[:, k] for k, name in enumerate(self.names)}

    def parameters_of(self, index: int) -> dict[str, float]:
        """Returns the parameters that pair `index` has."""
        values = self.parameters[index]
        return {str(self.names[k]): float(values[k]) for k in np.nonzero(~np.isnan(values))[0]}

    def fingerprint(self) -> str:
        """Computes the SHA-256 of every pair's identity, place and ground truth, in order: equal
        means the same data, by whatever query it was found."""
        digest = hashlib.sha256()
        for field in fields(self):
            values: AnyArray = getattr(self, field.name)
            digest.update(f"{field.name} {values.shape}\n".encode())
            text = values.dtype.kind == "U"
            digest.update(
                "\n".join(values.tolist()).encode()
                if text
                else np.ascontiguousarray(values).tobytes()
            )
        return digest.hexdigest()


def _text(rows: pa.Table, column: str) -> NDArray[np.str_]:
    return np.array(rows[column].fill_null("").to_pylist(), dtype=np.str_)


def _encode_column(rows: pa.Table, column: str) -> tuple[NDArray[np.str_], IntArray]:
    """Encodes a column: its different texts, sorted, and of each row which it has; as `np.unique`,
    without sorting all."""
    coded = rows[column].combine_chunks().dictionary_encode()
    texts, places = np.unique(
        np.array(coded.dictionary.to_pylist(), dtype=np.str_), return_inverse=True
    )
    return texts, places[coded.indices.to_numpy()].astype(np.int64)


def _number(rows: pa.Table, column: str, *, null: float) -> FloatArray:
    return rows[column].fill_null(null).to_numpy().astype(np.float64)


def _parameters(
    texts: Sequence[str | None], artifacts: Sequence[str]
) -> tuple[FloatArray, NDArray[np.str_]]:
    """Numbers of JSON objects as columns. Texts and lists among the parameters stay in the catalog
    only."""
    owners = {text: artifact for text, artifact in zip(texts, artifacts, strict=True) if text}
    parsed = {
        text: dict(_numbers(column_json(text, "parameters", artifact=artifact)))
        for text, artifact in owners.items()
    }
    names = sorted({name for values in parsed.values() for name in values})
    column = {name: k for k, name in enumerate(names)}
    out = np.full((len(texts), len(names)), np.nan)
    for row, text in enumerate(texts):
        for name, value in parsed[text].items() if text else ():
            out[row, column[name]] = value
    return out, np.array(names, dtype=np.str_)


def _add_labels(text: str | None, labels: Mapping[str, Any] | None, *, artifact: str) -> str | None:
    """Adds a clip's labels to its parameters."""
    if not labels:
        return text
    parameters = column_json(text, "parameters", artifact=artifact) if text else {}
    return json.dumps({**parameters, "label": labels})


def _numbers(values: Mapping[str, Any], prefix: str = "") -> list[tuple[str, float]]:
    numbers: list[tuple[str, float]] = []
    for name, value in values.items():
        if isinstance(value, Mapping):
            numbers.extend(_numbers(value, f"{prefix}{name}."))
        elif isinstance(value, (int, float)):
            numbers.append((prefix + name, float(value)))
    return numbers
