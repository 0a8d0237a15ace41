"""Exports read by the programs that they are for, each in an environment of its own."""

from __future__ import annotations

import hashlib
from pathlib import Path
from typing import Any

from flagdata.export import Export, export
from tests.flagdata.export.readers import read_by
from tests.studies.validation.environments import DATASETS

CLIPS = "kind = 'clip'"
PARQUET = """
import json, sys, io, hashlib
from datasets import load_dataset
data = load_dataset("parquet", data_files=sys.argv[1] + "/rows/*.parquet", split="train", cache_dir=sys.argv[2])
print(json.dumps([
    [r["artifact"], r["wind"], r["wind_sigma"], r["frame_times"], [hashlib.sha256(f).hexdigest() for f in r["frames"]]]
    for r in data
]))
"""
SHARDS = """
import json, sys
from datasets import load_dataset
data = load_dataset("webdataset", data_files=sys.argv[1] + "/*.tar", split="train", streaming=True)
print(json.dumps([
    [r["__key__"], r["json"]["wind"], r["json"]["frame_times"],
     [[r[f"{k:03d}.jpg"].size, r[f"{k:03d}.jpg"].getpixel((0, 0))] for k in range(30)]]
    for r in data
]))
"""


RERUN = """
import json, sys
from rerun.chunk import McapReader
found = {}
for chunk in McapReader(sys.argv[1]).stream():
    rows = chunk.to_record_batch()
    if chunk.num_rows > 1:
        names = rows.schema.names
        entry = found.setdefault(chunk.entity_path, {"time": [], "device": [], "values": []})
        entry["time"] += rows.column(names.index("message_log_time")).cast("int64").to_pylist()
        entry["device"] += rows.column(names.index("message_publish_time")).cast("int64").to_pylist()
        wanted = [n for n in names if n in ("EncodedImage:blob", "flagdata.WindSample:message")]
        for name in wanted:
            entry["values"] += rows.column(names.index(name)).to_pylist()
images = [bytes(one[0]).hex() for one in found["/camera/image"]["values"]]
speeds = [one[0]["speed"] for one in found["/wind/samples"]["values"]]
print(json.dumps({"time": found["/camera/image"]["time"], "device": found["/camera/image"]["device"],
                  "images": images, "wind": found["/wind/samples"]["time"], "speeds": speeds}))
"""


def test_hugging_face_loads_the_parquet_export_with_its_frames(known: Any, tmp_path: Path) -> None:
    export(
        known.lake,
        Export(format="parquet", where=CLIPS, options={"frames": "jpg"}),
        tmp_path / "out",
    )
    rows = read_by(DATASETS, PARQUET, tmp_path / "out", tmp_path / "cache", home=tmp_path)
    assert rows == [
        [
            known.clips[n],
            3.5 + n,
            0.125,
            known.times[30 * n : 30 * n + 30].tolist(),
            [hashlib.sha256(data).hexdigest() for data in known.jpegs[30 * n : 30 * n + 30]],
        ]
        for n in range(3)
    ]


def test_hugging_face_streams_the_webdataset_export(known: Any, tmp_path: Path) -> None:
    export(known.lake, Export(format="webdataset", where=CLIPS), tmp_path / "out")
    rows = read_by(DATASETS, SHARDS, tmp_path / "out", home=tmp_path)
    assert [(key, wind) for key, wind, _, _ in rows] == [
        (known.clips[n], 3.5 + n) for n in range(3)
    ]
    assert [times for _, _, times, _ in rows] == [
        known.times[30 * n : 30 * n + 30].tolist() for n in range(3)
    ]
    for n, (_, _, _, pictures) in enumerate(rows):
        for k, (size, gray) in enumerate(pictures):
            assert size == [64, 48]
            assert abs(gray - int(known.images[30 * n + k, 0, 0])) <= 3  # JPEG at quality 95


def test_rerun_shows_frames_on_both_clocks_and_the_samples_of_the_wind(
    known: Any, tmp_path: Path
) -> None:
    export(known.lake, Export(format="mcap", where="kind = 'recording'"), tmp_path / "out")
    found = read_by(DATASETS, RERUN, tmp_path / "out" / f"{known.recording}.mcap", home=tmp_path)
    assert found["time"] == known.times.tolist()
    assert found["device"] == (known.times - 7 * 10**9).tolist()
    assert found["images"] == [data.hex() for data in known.jpegs]
    assert found["wind"] == known.wind_time.tolist()
    assert found["speeds"] == known.wind_speed.tolist()
