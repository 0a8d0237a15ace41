"""croissant.json of every export: valid by the specification's own library, true of its files, and
its tables read."""

from __future__ import annotations

import hashlib
import json
from pathlib import Path
from typing import Any

import mlcroissant
import pytest

from flagdata.export import FORMATS, Export, export

pytestmark = [  # of rdflib and pandas, as mlcroissant calls them
    pytest.mark.filterwarnings("ignore:ConjunctiveGraph is deprecated"),
    pytest.mark.filterwarnings("ignore:The inplace keyword in DataFrame.reset_index is deprecated"),
]
CLIPS, RECORDINGS = "kind = 'clip'", "kind = 'recording'"
OF_FILMS = [name for name in FORMATS if name != "obj"]


def exported(known: Any, folder: Path, name: str, **options: Any) -> mlcroissant.Dataset:
    request = Export(format=name, where=RECORDINGS if name == "csv" else CLIPS, options=options)
    export(known.lake, request, folder)
    return mlcroissant.Dataset(jsonld=folder / "croissant.json")


@pytest.mark.parametrize("name", OF_FILMS)
def test_each_format_is_valid_and_names_its_files_with_size_and_hash(
    name: str, known: Any, tmp_path: Path
) -> None:
    """Raises ValidationError where the specification is broken; licence, address and creator are
    the publisher's."""
    dataset = exported(known, tmp_path / "out", name)
    assert not dataset.metadata.ctx.issues.errors
    stated = {
        entry["contentUrl"]: (entry["contentSize"], entry["sha256"])
        for entry in json.loads((tmp_path / "out" / "croissant.json").read_text())["distribution"]
        if entry["@type"] == "cr:FileObject"
    }
    files = [path for path in (tmp_path / "out").rglob("*") if path.is_file()]
    assert stated == {
        path.relative_to(tmp_path / "out").as_posix(): (
            f"{path.stat().st_size} B",
            hashlib.sha256(path.read_bytes()).hexdigest(),
        )
        for path in files
        if path.name not in ("croissant.json", "manifest.json")
    }


def test_rows_of_parquet_are_read_with_their_wind_and_units(known: Any, tmp_path: Path) -> None:
    dataset = exported(known, tmp_path / "out", "parquet")
    records = "rows/part-00000.parquet/records"
    rows = list(dataset.records(records))
    assert [row[f"{records}/artifact"].decode() for row in rows] == list(known.clips)
    assert [row[f"{records}/wind"] for row in rows] == [3.5, 4.5, 5.5]
    (record_set,) = dataset.metadata.record_sets
    assert "[m/s]" in {field.name: field.description for field in record_set.fields}["wind"]


def test_samples_of_a_csv_are_read_with_their_wind(known: Any, tmp_path: Path) -> None:
    dataset = exported(known, tmp_path / "out", "csv")
    records = f"{known.recording}.csv/records"
    speeds = [row[f"{records}/wind_speed_m_s_"] for row in dataset.records(records)]
    assert speeds == pytest.approx(known.wind_speed.tolist(), abs=1e-12)


def test_samples_of_webdataset_are_a_set_of_files_within_their_shard(
    known: Any, tmp_path: Path
) -> None:
    dataset = exported(known, tmp_path / "out", "webdataset")
    (shard, samples) = dataset.metadata.distribution
    assert (shard.encoding_formats, samples.includes) == (["application/x-tar"], ["*.json"])
    assert [
        source.uuid if hasattr(source, "uuid") else source for source in samples.contained_in
    ] == [shard.uuid]
