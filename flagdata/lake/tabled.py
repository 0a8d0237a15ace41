"""Labels beside the rows of a table: how `Store.table` hands them on, in the metadata of the table's schema."""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping
from typing import Any

import pyarrow as pa

from flagdata.lake.lineage import noted_labels

_KEY = b"flagdata.labels"


def folded(entries: Iterable[Mapping[str, Any]]) -> dict[str, dict[str, Any]]:
    """Artifact → its labels, after the commits given, oldest first.

    Raises:
        CorruptError: what a commit notes cannot be read.
    """
    found: dict[str, dict[str, Any]] = {}
    for entry in entries:
        for artifact, values in noted_labels(entry).items():
            labels = found.setdefault(artifact, {})
            labels.update(values)
            for name in [name for name, value in labels.items() if value is None]:
                del labels[name]
    return {artifact: labels for artifact, labels in found.items() if labels}


def with_labels(rows: pa.Table, labels: Mapping[str, Mapping[str, Any]]) -> pa.Table:
    """The rows, with the labels of artifacts beside them."""
    if not labels:
        return rows
    text = json.dumps(labels, ensure_ascii=False, sort_keys=True)
    return rows.replace_schema_metadata({**(rows.schema.metadata or {}), _KEY: text.encode()})


def labels_of(rows: pa.Table) -> dict[str, dict[str, Any]]:
    """Artifact → its labels, of a table of rows that `Store.table` gave, whole or filtered."""
    text = (rows.schema.metadata or {}).get(_KEY)
    return {} if text is None else json.loads(text)
