"""LeRobot data sets, read back by LeRobot itself: each frame, instant and number is the one that
was recorded."""

from __future__ import annotations

import hashlib
import json
import os
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow.parquet as pq
import pytest

from flagdata.errors import InputError, UsageError
from flagdata.export import Export, export
from flagdata.export.lerobot import common_rate
from tests.flagdata.export.readers import read_by
from tests.studies.validation.environments import LEROBOT

CLIPS = "kind = 'clip'"
READ = """
import json, sys, hashlib
import numpy as np
from lerobot.datasets.lerobot_dataset import LeRobotDataset
data = LeRobotDataset("known/clips", root=sys.argv[1], video_backend="pyav")
items = [data[k] for k in range(len(data))]
pictures = [np.round(item["observation.images.camera"].numpy() * 255).astype(np.uint8) for item in items]
around = LeRobotDataset("known/clips", root=sys.argv[1], video_backend="pyav",
                        delta_timestamps={"observation.wind_speed": [-1 / data.fps, 0.0]})
print(json.dumps({
    "length": len(data), "episodes": data.num_episodes, "fps": data.fps, "task": items[0]["task"],
    "shape": list(pictures[0].shape),
    "time": [item["flagdata.time"].item() for item in items],
    "timestamp": [item["timestamp"].item() for item in items],
    "episode": [item["episode_index"].item() for item in items],
    "wind": [item["observation.wind_speed"].item() for item in items],
    "age": [item["observation.wind_age"].item() for item in items],
    "mean": [float(p.mean()) for p in pictures],
    "sha": [hashlib.sha256(p[0].tobytes()).hexdigest() for p in pictures],
    "pair": around[1]["observation.wind_speed"].tolist(),
    "stat": float(data.meta.stats["observation.wind_speed"]["mean"][0]),
}))
"""


@pytest.mark.parametrize("frames", ["png", "av1"])
def test_lerobot_reads_back_every_frame_and_number(known: Any, tmp_path: Path, frames: str) -> None:
    export(
        known.lake,
        Export(format="lerobot", where=CLIPS, options={"frames": frames}),
        tmp_path / "out",
    )
    found = read_by(LEROBOT, READ, tmp_path / "out", home=tmp_path)
    assert (found["length"], found["episodes"], found["shape"]) == (90, 3, [3, 48, 64])
    assert found["time"] == known.times.tolist()
    assert found["episode"] == [0] * 30 + [1] * 30 + [2] * 30
    np.testing.assert_allclose(found["timestamp"], np.arange(90) % 30 / found["fps"], atol=1e-6)
    # Means over the second that ended last: sample k of the log, at noon + k seconds, lies in the
    # second that ends then or one later, so the mean is one sample's value, 3.0 m/s and 0.05 more
    # each second.
    seconds = (known.times - known.wind_time[0]) / 1e9
    assert all(0 <= age < 1 for age in found["age"])
    steps = (np.array(found["wind"]) - 3.0) / 0.05
    np.testing.assert_allclose(steps, np.round(steps), atol=1e-4)
    assert np.all((seconds - np.array(found["age"])) - steps <= 1 + 1e-5)
    assert found["pair"] == pytest.approx([found["wind"][0], found["wind"][1]])
    assert found["stat"] == pytest.approx(np.mean(found["wind"]), rel=1e-6)
    stored = known.lake.rows({"kind": "recording"}).to_pylist()[0]["object"]
    from flagdata.record import Record

    images = Record.open(known.lake.object_path(stored)).frames(0, 90)
    if frames == "png":
        assert found["sha"] == [hashlib.sha256(image.tobytes()).hexdigest() for image in images]
    else:  # crf 30: a smooth slope keeps its mean to a level
        np.testing.assert_allclose(found["mean"], images.mean(axis=(1, 2)), atol=1.5)


@pytest.mark.skipif(os.geteuid() != 0, reason="only as root SVT-AV1 takes real-time priority")
def test_an_export_of_films_leaves_the_process_the_priority_that_it_had(
    known: Any, tmp_path: Path
) -> None:
    export(
        known.lake,
        Export(format="lerobot", where=CLIPS, options={"frames": "av1"}),
        tmp_path / "out",
    )
    policies = set()
    for thread in Path("/proc/self/task").iterdir():
        with suppress(ProcessLookupError):  # it has ended since
            policies.add(os.sched_getscheduler(int(thread.name)))
    assert policies == {os.SCHED_OTHER}


def test_identity_truth_and_clock_stand_in_the_table_of_episodes(
    known: Any, tmp_path: Path
) -> None:
    export(
        known.lake,
        Export(format="lerobot", where=CLIPS, options={"frames": "png"}),
        tmp_path / "out",
    )
    rows = pq.read_table(tmp_path / "out" / "meta" / "episodes").to_pylist()
    assert [row["flagdata/artifact"] for row in rows] == list(known.clips)
    assert [row["flagdata/wind"] for row in rows] == [3.5, 4.5, 5.5]
    assert [json.loads(row["flagdata/label"])["clock_offset"] for row in rows] == [7.0] * 3
    assert [(row["dataset_from_index"], row["dataset_to_index"]) for row in rows] == [
        (0, 30),
        (30, 60),
        (60, 90),
    ]
    assert (
        pq.ParquetFile(tmp_path / "out" / "data" / "chunk-000" / "file-000.parquet").num_row_groups
        == 3
    )


def test_a_film_with_a_gap_is_refused_since_lerobot_has_no_place_for_it(
    known: Any, tmp_path: Path
) -> None:
    # Frames 40 and 33.4 ms apart by turns keep to their mean rate; a rate of 25 Hz they leave.
    assert float(common_rate([27.3])) == pytest.approx(27.3, abs=1e-6)
    assert common_rate([24.9999, 25.0, 25.00001]) == 25
    with pytest.raises(InputError, match="no film"):
        common_rate([])
    with pytest.raises(UsageError):
        export(known.lake, Export(format="lerobot", options={"frames": "jpg"}), tmp_path / "out")
