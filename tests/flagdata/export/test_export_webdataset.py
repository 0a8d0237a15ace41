"""WebDataset exports, read back by the `webdataset` package and by plain tar."""

from __future__ import annotations

import tarfile
import warnings
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from flagdata.errors import LimitError
from flagdata.export import Export, export

CLIPS = "kind = 'clip'"


def read(folder: Path) -> list[dict[str, Any]]:
    """All samples, decoded by webdataset itself."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # the package's own deprecations
        import webdataset

        shards = sorted(str(path) for path in folder.glob("*.tar"))
        return list(webdataset.WebDataset(shards, shardshuffle=False).decode("l8"))


def test_webdataset_gives_back_ground_truth_identity_and_instants(
    known: Any, tmp_path: Path
) -> None:
    export(known.lake, Export(format="webdataset", where=CLIPS), tmp_path / "out")
    samples = read(tmp_path / "out")
    assert [sample["__key__"] for sample in samples] == list(known.clips)
    for number, sample in enumerate(samples):
        label = sample["json"]
        assert (label["wind"], label["wind_sigma"], label["clock_sigma"]) == (
            3.5 + number,
            0.125,
            0.02,
        )
        assert label["artifact"] == known.clips[number]
        assert (label["recording"], label["session"], label["day"]) == (
            known.recording,
            "pier",
            "2026-05-01",
        )
        assert label["frame_times"] == known.times[30 * number : 30 * number + 30].tolist()
    assert samples[0]["json"]["parameters"] == {"area_weight": 0.2}
    assert samples[1]["json"]["parameters"] is None
    assert samples[2]["json"]["parameters"] == {"damping": None}  # JSON has no NaN
    assert samples[1]["json"]["quality"] == ["wind-stale"]
    assert samples[0]["json"]["start_time"] == "2026-05-01T12:01:20Z"  # noon and 80 s


def test_jpg_members_are_the_stored_bytes_in_order(known: Any, tmp_path: Path) -> None:
    export(known.lake, Export(format="webdataset", where=CLIPS), tmp_path / "out")
    with tarfile.open(tmp_path / "out" / "clip-000000.tar") as tar:
        names = [
            name
            for name in tar.getnames()
            if name.startswith(known.clips[1]) and name.endswith(".jpg")
        ]
        stored = [tar.extractfile(name).read() for name in names]  # type: ignore[union-attr]
    assert names == sorted(names)
    assert stored == list(known.jpegs[30:60])


def test_decoded_frames_are_the_pictures_that_were_recorded(known: Any, tmp_path: Path) -> None:
    export(
        known.lake,
        Export(format="webdataset", where=CLIPS, options={"frames": "npy"}),
        tmp_path / "npy",
    )
    export(known.lake, Export(format="webdataset", where=CLIPS), tmp_path / "jpg")
    arrays = np.stack([sample["npy"] for sample in read(tmp_path / "npy")])
    assert arrays.shape == (3, 30, 48, 64)
    assert arrays.dtype == np.uint8
    # A smooth slope through JPEG of quality 95: at most the quantisation of a few coefficients.
    assert np.abs(arrays.reshape(90, 48, 64).astype(int) - known.images).max() <= 3
    sample = read(tmp_path / "jpg")[2]
    pictures = np.stack([sample[f"{index:03d}.jpg"] for index in range(30)])
    assert np.abs(pictures.astype(int) - known.images[60:]).max() <= 3


def test_shards_are_bounded_and_together_hold_every_sample_once(known: Any, tmp_path: Path) -> None:
    export(known.lake, Export(format="webdataset", where=CLIPS), tmp_path / "one")
    whole = (tmp_path / "one" / "clip-000000.tar").stat().st_size
    limit = whole // 2
    request = Export(format="webdataset", where=CLIPS, options={"shard_bytes": limit})
    manifest = export(known.lake, request, tmp_path / "many").manifest
    shards = sorted((tmp_path / "many").glob("*.tar"))
    assert len(shards) > 1
    assert all(shard.stat().st_size <= limit for shard in shards)
    assert [sample["__key__"] for sample in read(tmp_path / "many")] == list(known.clips)
    assert sum(shard["samples"] for shard in manifest["shards"]) == 3


def test_a_sample_that_fits_no_shard_is_refused_and_leaves_nothing(
    known: Any, tmp_path: Path
) -> None:
    request = Export(format="webdataset", where=CLIPS, options={"shard_bytes": 20_480})
    with pytest.raises(LimitError, match="larger than a shard"):
        export(known.lake, request, tmp_path / "out")
    assert list(tmp_path.iterdir()) == []


def test_shuffling_is_by_seed_and_loses_no_sample(known: Any, tmp_path: Path) -> None:
    orders = []
    for seed in range(8):
        folder = tmp_path / str(seed)
        export(
            known.lake, Export(format="webdataset", where=CLIPS, options={"shuffle": seed}), folder
        )
        orders.append(tuple(sample["__key__"] for sample in read(folder)))
    assert all(sorted(order) == sorted(known.clips) for order in orders)
    assert len(set(orders)) > 1
    export(
        known.lake,
        Export(format="webdataset", where=CLIPS, options={"shuffle": 3}),
        tmp_path / "again",
    )
    assert (tmp_path / "again" / "clip-000000.tar").read_bytes() == (
        tmp_path / "3" / "clip-000000.tar"
    ).read_bytes()
