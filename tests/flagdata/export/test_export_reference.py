"""The whole way on real files: a flag's video and a sonic's log in, every export out, truth and pictures compared."""

from __future__ import annotations

import json
import warnings
from pathlib import Path

import av
import numpy as np
import polars as pl
import pytest

from flagdata.cli import main
from flagdata.dataset.truth import TruthSeries
from flagdata.export import FORMATS, Export
from flagdata.lake import Lake
from flagdata.record import Record
from flagdata.schema import Kind

CLIPS = "kind = 'clip'"
FILMED_FORMATS = [name for name in FORMATS if Kind.CLIP in Export(format=name).exporter().kinds]


def run(*arguments: str) -> None:
    with pytest.raises(SystemExit) as stopped:
        main(list(arguments))
    assert stopped.value.code == 0


@pytest.fixture(scope="module")
def folder(reference_data: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A lake of the DynTex flag and a quarter of an hour of a CSAT3, declared simultaneous; all exports of it."""
    root = tmp_path_factory.mktemp("reference")
    lake = str(root / "lake")
    run("init", lake)
    video, log = reference_data / "video" / "dyntex_flag_571c110.avi", reference_data / "wind" / "toa5_csat3_20hz.dat"
    run("ingest", "--lake", lake, str(video), "--start", "2012-06-07T12:50:00Z")
    run("ingest", "--lake", lake, str(log), "--zone", "UTC")
    camera, wind = (Lake.open(lake).rows(f"kind = '{kind}'")["artifact"][0].as_py() for kind in ("camera", "wind"))
    run("align", "--lake", lake, camera, wind, "--by", "given", "--offset", "0", "--offset-sigma", "0.1")
    for name in FILMED_FORMATS:
        options = ["--frames", "jpg"] if name == "parquet" else []
        run("export", name, "--lake", lake, "--where", CLIPS, "--to", str(root / name), *options)
    return root


@pytest.mark.reference
def test_every_format_holds_the_eight_clips_of_ten_seconds(folder: Path) -> None:
    # 250 frames are eight clips of 30, and 10 frames over.
    for name in FILMED_FORMATS:
        assert json.loads((folder / name / "manifest.json").read_text())["artifacts"] == 8


@pytest.mark.reference
def test_the_truth_of_each_clip_follows_from_its_subset_alone(folder: Path) -> None:
    for row in Lake.open(folder / "lake").rows(CLIPS).to_pylist():
        record = Record.open(folder / "mcap" / f"{row['artifact']}.mcap")
        wind = record.wind()
        assert wind is not None
        again = TruthSeries.of(wind).before(int(record.frame_times[-1]), clock_sigma=row["clock_sigma"])
        # The same samples in the same order: rounding only. σ also looks a second past the window, which was cut.
        assert again.wind == pytest.approx(row["wind"], abs=1e-12)
        assert again.sigma == pytest.approx(row["wind_sigma"], rel=1e-4)


@pytest.mark.reference
def test_all_formats_hold_the_same_pictures(folder: Path) -> None:
    clip = Lake.open(folder / "lake").rows(CLIPS)["artifact"][3].as_py()
    stored = Record.open(folder / "mcap" / f"{clip}.mcap")
    jpegs = [stored.jpeg(index) for index in range(30)]
    rows = pl.read_parquet(folder / "parquet" / "rows" / "*.parquet").filter(pl.col("artifact") == clip)
    assert rows["frames"].to_list() == [jpegs]
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # the package's own deprecations
        import webdataset

        shards = [str(path) for path in (folder / "webdataset").glob("*.tar")]
        samples = {sample["__key__"]: sample for sample in webdataset.WebDataset(shards, shardshuffle=False)}
    assert [samples[clip][f"{index:03d}.jpg"] for index in range(30)] == jpegs
    with av.open(str(folder / "mp4" / f"{clip}.mp4")) as container:
        video = np.stack([frame.to_ndarray(format="gray") for frame in container.decode(video=0)]).astype(float)
    # x264 at a rate factor of 18 keeps natural pictures at 40 dB or more: a root mean square of 255 / 100.
    assert np.sqrt(np.mean((video - stored.frames(0, 30)) ** 2)) < 2.55
