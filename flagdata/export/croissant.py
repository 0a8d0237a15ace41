"""croissant.json: what an export holds, as Croissant metadata that data-set hubs and `mlcroissant`
read.

Source: MLCommons, Croissant Format Specification 1.0 (http://mlcommons.org/croissant/1.0). Every
file is a file object with its size and SHA-256. Tables (Parquet, CSV) are record sets, whose fields
have the units that the manifest states. The samples within the shards of WebDataset are a file set:
`mlcroissant` 1.1 cannot read JSON out of an archive.
"""

from __future__ import annotations

import json
import mimetypes
import re
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import pyarrow as pa
import pyarrow.parquet as pq
from pyarrow.csv import open_csv

from flagdata.core.schema import CATALOG, CHANNELS

CROISSANT = "croissant.json"
CONFORMS_TO = "http://mlcommons.org/croissant/1.0"
CONTEXT = {
    "@language": "en",
    "@vocab": "https://schema.org/",
    "citeAs": "cr:citeAs",
    "column": "cr:column",
    "conformsTo": "dct:conformsTo",
    "cr": "http://mlcommons.org/croissant/",
    "rai": "http://mlcommons.org/croissant/RAI/",
    "data": {"@id": "cr:data", "@type": "@json"},
    "dataType": {"@id": "cr:dataType", "@type": "@vocab"},
    "dct": "http://purl.org/dc/terms/",
    "equivalentProperty": "cr:equivalentProperty",
    "examples": {"@id": "cr:examples", "@type": "@json"},
    "extract": "cr:extract",
    "field": "cr:field",
    "fileProperty": "cr:fileProperty",
    "fileObject": "cr:fileObject",
    "fileSet": "cr:fileSet",
    "format": "cr:format",
    "includes": "cr:includes",
    "isLiveDataset": "cr:isLiveDataset",
    "jsonPath": "cr:jsonPath",
    "key": "cr:key",
    "md5": "cr:md5",
    "parentField": "cr:parentField",
    "path": "cr:path",
    "recordSet": "cr:recordSet",
    "references": "cr:references",
    "regex": "cr:regex",
    "repeated": "cr:repeated",
    "replace": "cr:replace",
    "samplingRate": "cr:samplingRate",
    "sc": "https://schema.org/",
    "separator": "cr:separator",
    "source": "cr:source",
    "subField": "cr:subField",
    "transform": "cr:transform",
}
"""The context of the specification, appendix 1."""

_NO_IDENTIFIER = re.compile(r"[^\w.-]+")
_OTHER_MEDIA_TYPE = "application/octet-stream"
_MEDIA_TYPES = {
    ".csv": "text/csv",
    ".json": "application/json",
    ".jsonl": "application/jsonlines",
    ".mp4": "video/mp4",
    ".obj": "model/obj",
    ".parquet": "application/x-parquet",
    ".tar": "application/x-tar",
}
_DATA_TYPES: tuple[tuple[Callable[[pa.DataType], bool], str], ...] = (
    (pa.types.is_boolean, "sc:Boolean"),
    (pa.types.is_integer, "sc:Integer"),
    (pa.types.is_floating, "sc:Float"),
    (pa.types.is_timestamp, "sc:DateTime"),
    (pa.types.is_binary, "sc:ImageObject"),
)


def write_croissant(folder: Path, manifest: Mapping[str, Any]) -> Path:
    """Writes croissant.json, and returns its path."""
    path = folder / CROISSANT
    text = json.dumps(croissant(folder, manifest), indent=1, allow_nan=False, ensure_ascii=False)
    path.write_text(text + "\n", encoding="utf-8")
    return path


def croissant(folder: Path, manifest: Mapping[str, Any]) -> dict[str, Any]:
    """Describes an export as a Croissant data set (JSON-LD).

    Licence, creator and address of a data set are its publisher's to state; they are not made up
    here.

    Args:
        folder: the export.
        manifest: its content, see `flagdata.core.files.manifest.write_manifest`.
    """
    paths = [entry["path"] for entry in manifest["files"]]
    record_sets = [_record_set(folder, path, manifest.get("units", {})) for path in paths]
    return {
        "@context": CONTEXT,
        "@type": "sc:Dataset",
        "conformsTo": CONFORMS_TO,
        "name": f"flagdata-{manifest['format']}-{manifest['recipe_hash'][:12]}",
        "description": _description(manifest),
        "version": f"{manifest['version']}.0.0",
        "distribution": [
            *map(_file_object, manifest["files"]),
            *(_samples_of(path) for path in paths if path.endswith(".tar")),
        ],
        "recordSet": [record_set for record_set in record_sets if record_set is not None],
    }


def _description(manifest: Mapping[str, Any]) -> str:
    """Says what was selected, and from which version."""
    kinds = ", ".join(f"{count} of kind {kind}" for kind, count in manifest["kinds"].items())
    selected = "" if manifest["where"] is None else f" where {manifest['where']}"
    side = "" if manifest["split"] is None else f", side {manifest['split']} of the split"
    return (
        "Films of cloth in the wind with measured or simulated ground truth, exported by flagdata "
        "as "
        f"{manifest['format']}: {kinds}{selected}{side}, version {manifest['version']} of the "
        "lake. "
        f"{_sides(manifest['split_by'])}manifest.json has the recipe."
    )


def _sides(split_by: Mapping[str, Any] | None) -> str:
    """Says who decided the sides, and what they hold; nothing where there are none."""
    if split_by is None:
        return ""
    rule = (
        f"stated by {', '.join(split_by['datasets'])}"
        if split_by["rule"] == "stated"
        else split_by["rule"]
    )
    sizes = ", ".join(f"{side} {size['clips']} clips" for side, size in split_by["sides"].items())
    return f"Sides, {rule}: {sizes}. "


def _file_object(entry: Mapping[str, Any]) -> dict[str, Any]:
    """Describes a file, as the manifest lists it."""
    path = entry["path"]
    return {
        "@type": "cr:FileObject",
        "@id": path,
        "name": path,
        "contentUrl": path,
        "contentSize": f"{entry['bytes']} B",
        "encodingFormat": _MEDIA_TYPES.get(Path(path).suffix)
        or mimetypes.guess_type(path)[0]
        or _OTHER_MEDIA_TYPE,
        "sha256": entry["sha256"],
    }


def _samples_of(shard: str) -> dict[str, Any]:
    """Describes the JSON files within a shard of WebDataset."""
    return {
        "@type": "cr:FileSet",
        "@id": f"{shard}/samples",
        "name": f"{shard}/samples",
        "containedIn": {"@id": shard},
        "encodingFormat": "application/json",
        "includes": "*.json",
    }


def _record_set(folder: Path, path: str, units: Mapping[str, str]) -> dict[str, Any] | None:
    """Describes the records of a file; None for one that holds none."""
    match Path(path).suffix:
        case ".parquet":
            schema = pq.read_schema(folder / path)
        case ".csv":
            with open_csv(folder / path) as rows:
                schema = rows.schema
        case _:
            return None
    records = f"{path}/records"
    return {
        "@type": "cr:RecordSet",
        "@id": records,
        "name": records,
        "field": [
            {
                "@type": "cr:Field",
                "@id": f"{records}/{_NO_IDENTIFIER.sub('_', column.name)}",
                "name": column.name,
                "description": _about(column.name, units.get(column.name)),
                "dataType": _data_type(column.type),
                **({"repeated": True} if pa.types.is_list(column.type) else {}),
                "source": {"fileObject": {"@id": path}, "extract": {"column": column.name}},
            }
            for column in schema
            if not pa.types.is_nested(column.type) or pa.types.is_list(column.type)
        ],
    }


def _data_type(arrow_type: pa.DataType) -> str:
    """Returns the type that Croissant has for a value, or for the values of a list."""
    value_type = arrow_type.value_type if isinstance(arrow_type, pa.ListType) else arrow_type
    return next((name for is_type, name in _DATA_TYPES if is_type(value_type)), "sc:Text")


def _about(column: str, unit: str | None) -> str:
    """Says what a column holds, with its unit."""
    name = column.partition(" [")[0]
    known = CATALOG.get(name) or CHANNELS.get(name)
    about = name if known is None else known.about
    unit = unit or (known.unit if known is not None else "")
    return f"{about} [{unit}]" if unit else about
