"""`flagdata measure` from files and lakes: the answer, the refusal, the artifact, and clear
errors."""

from __future__ import annotations

import csv
import errno
import io
import json
import re
import shutil
from collections.abc import Sequence
from pathlib import Path
from typing import NoReturn

import numpy as np
import pytest
import torch
from PIL import Image

import flagdata
from flagdata.core.console import progress
from flagdata.core.json_values import json_values
from flagdata.core.schema import Kind
from flagdata.core.stated import Stated
from flagdata.dataset import clip_rows
from flagdata.errors import RefusedError, UnknownNameError, UsageError
from flagdata.lake import Artifact, Lake, clone, objects
from flagdata.record import Record, RecordWriter
from flagdata.record.signals import Sensor, WindSeries
from flagdata.timebase import NANOSECONDS
from measure.commands import read
from measure.estimate import DRAWS, weight_of
from measure.estimate.nearest import nearest
from models.conditioning import condition_film
from models.trained.estimator import DEFAULT, Estimator
from tests.measure.estimate.conftest import FRAMES, RATE, pictures, write_video
from tests.program import Ended, invoke

START = 1_700_000_000 * NANOSECONDS
SIZED = ("--flag-size", "1.5x1.0")


def run(*arguments: str | Path, code: int = 0) -> Ended:
    ended = invoke("measure", *arguments)
    assert ended.code == code, ended.out + ended.err
    return ended


def answer(*arguments: str | Path) -> dict[str, object]:
    return json.loads(run(*arguments, "--json").out)


@pytest.fixture(scope="module")
def film(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_video(
        tmp_path_factory.mktemp("films") / "flag.mkv", pictures(4 * FRAMES, height=40, width=56)
    )


@pytest.fixture
def strange(tmp_path: Path) -> Path:
    noise = np.random.default_rng(1).integers(0, 256, size=(3 * FRAMES, 40, 40)).astype(np.uint8)
    return write_video(tmp_path / "noise.mkv", noise)


def record(path: Path, *, seed: int) -> None:
    times = START + np.round(np.arange(4 * FRAMES) / RATE * NANOSECONDS).astype(np.int64)
    with RecordWriter(path, metadata={"camera": {"name": "made"}}) as writer:
        for time, frame in zip(times.tolist(), pictures(4 * FRAMES, seed=seed), strict=True):
            writer.frame(log_time=time, publish_time=time, timestamp=time, image=frame)
        seconds = START + np.arange(-70, 4, dtype=np.int64) * NANOSECONDS
        writer.wind(
            WindSeries(
                time=seconds,
                channels={"wind_speed": np.full(len(seconds), 4.0)},
                flags=np.zeros(len(seconds), dtype=np.uint16),
                sensor=Sensor(name="cup"),
            )
        )
        writer.truth({"wind_speed": 4.0, "area_weight": 0.12}, log_time=START)


@pytest.fixture
def lake(tmp_path: Path) -> Path:
    """Two recordings with their clips."""
    made = Lake.create(tmp_path / "lake")
    with made.transaction("two films") as transaction:
        for seed in (1, 2):
            staged = transaction.staging(".mcap")
            record(staged, seed=seed)
            stored = transaction.put(staged)
            artifact = Artifact(
                kind=Kind.RECORDING,
                name=f"made-{seed}",
                seed=seed,
                object=stored,
                recipe={"seed": seed},
                start=START,
                frame_count=4 * FRAMES,
                rate=RATE,
            )
            transaction.add(artifact)
            for clip in clip_rows(
                Record.open(made.object_path(stored)), artifact, frames=FRAMES + 2
            ):
                transaction.add(clip)
    return made.path


def measurements(lake: Path) -> Sequence[dict[str, object]]:
    return Lake.open(lake).rows("kind = 'measurement'").to_pylist()


def test_a_video_file_is_answered_in_one_line(film: Path, model_folder: Path) -> None:
    done = run(film, *SIZED, "--model", model_folder, "--anyway")
    assert len(done.out.splitlines()) == 1
    assert re.search(
        r"wind(: not constrained by this clip| \d+\.\d m/s \[\d+\.\d, \d+\.\d\] 90 %)", done.out
    )


def test_python_gives_the_answer_of_the_command_as_arrays(film: Path, model_folder: Path) -> None:
    options = ("--model", model_folder, "--area-weight", "0.12:0.15", "--anyway")
    said = answer(film, *SIZED, *options)
    found = flagdata.measure(
        film, flag_size=(1.5, 1.0), area_weight=(0.12, 0.15), model=str(model_folder), anyway=True
    )
    assert found.document == {key: value for key, value in said.items() if key != "schema"}
    assert found.refused == said["gate"]["refused"]  # type: ignore[index]
    assert json_values(found.findings) == said["findings"]
    assert found.figures == said["conditioning"]
    for name, own in said["quantities"].items():  # type: ignore[attr-defined]
        estimate = found.quantities[name]
        ends = [None if np.isinf(end) else end for end in estimate.interval]
        assert (estimate.value, ends, estimate.unit) == (own["value"], own["interval"], own["unit"])
    assert found.wind is found.quantities["wind_speed"]
    assert {values.shape for values in found.draws.values()} == {(DRAWS,)}
    assert found.draws["wind_speed"].mean() == pytest.approx(found.wind.value)
    windows = said["windows"]
    np.testing.assert_array_equal(found.windows.start, [window["start"] for window in windows])  # type: ignore[attr-defined]
    assert found.windows.low["area_weight"].min() >= 0.12
    assert {values.shape for values in found.windows.value.values()} == {(4,)}


def test_python_returns_a_refused_film_with_its_reasons_and_hides_its_values(
    strange: Path, model_folder: Path
) -> None:
    found = flagdata.measure(strange, flag_size=(1.5, 1.0), model=str(model_folder))
    assert found.refused
    kinds = [reason.kind for reason in found.reasons]
    assert (kinds[0], kinds[-1]) == ("too-dark", "unlike-training")
    assert all(reason.value is not None for reason in found.reasons)
    assert re.match(r"Refused: the picture may be too dark.*\.$", found.sentence)
    assert not found.quantities
    for name in ("wind", "draws", "windows", "gusts"):
        with pytest.raises(RefusedError, match=r"noise of [\d.]+ gray levels"):
            getattr(found, name)
    with pytest.raises(RefusedError, match="gray levels"):
        found.quantities["area_weight"]
    assert (
        flagdata.measure(
            strange, flag_size=(1.5, 1.0), model=str(model_folder), anyway=True
        ).wind.unit
        == "m/s"
    )
    with pytest.raises(UsageError, match="twice"):
        flagdata.measure(strange, area_weight=0.1, material="paper")


def test_the_shipped_model_measures_a_file_without_any_option_but_the_films(tmp_path: Path) -> None:
    path = write_video(tmp_path / "flag.mkv", pictures(40, height=240, width=320))
    found = answer(path, "--anyway")
    assert found["model"] == DEFAULT
    assert "size-assumed" in [finding["kind"] for finding in found["findings"]]  # type: ignore[index, union-attr]


def test_a_material_states_its_area_weight_from_the_catalog_or_the_lakes_films(
    film: Path, lake: Path
) -> None:
    named = (film, *SIZED, "--anyway", "--json", "--read-only", "--lake", lake, "--material")
    done = run(*named, "tango-red-jet-set")
    assert "Wang" in done.err
    found = json.loads(done.out)
    assert found["options"]["area_weight"] == 0.113  # Wang et al. 2011, table of densities
    assert found["quantities"]["area_weight"]["given"] is True
    assert found["sentence"].endswith("area weight 0.113 kg/m², as given")
    made = Lake.open(lake)
    with made.transaction("declared") as transaction:
        for name, session, area_weight in (
            ("one", "felt", 0.24),
            ("two", "linen", 0.2),
            ("three", "linen", 0.21),
        ):
            cloth = {"cloth": {"fabric": session, "density": area_weight}}  # as recipes are hashed
            transaction.add(
                Artifact(
                    kind=Kind.RECORDING, name=name, session=session, recipe=cloth, frame_count=1
                )
            )
    assert weight_of("felt", lake=made, at=None)[0] == Stated.of(0.24)
    with pytest.raises(UsageError, match=r"2 area weights, 0\.2 to 0\.21"):
        weight_of("linen", lake=made, at=None)
    with pytest.raises(UnknownNameError, match="felt"):
        weight_of("fellt", lake=made, at=None)
    with pytest.raises(UnknownNameError, match="--material"):
        weight_of("felt", lake=None, at=None)
    assert "twice" in run(film, "--material", "paper", "--area-weight", "0.1", code=2).err


def test_the_shipped_model_of_hanging_cloth_gives_weights_of_its_range(film: Path) -> None:
    found = answer(film, "--flag-size", "1x1", "--model", "wave-cloth", "--anyway")
    low, high = found["quantities"]["area_weight"]["interval"]  # type: ignore[index]
    assert 0.079 <= low < high <= 0.454


def test_a_folder_of_images_and_the_video_of_them_say_the_same(
    film: Path, model_folder: Path, tmp_path: Path
) -> None:
    folder = tmp_path / "images"
    folder.mkdir()
    for k, image in enumerate(pictures(4 * FRAMES, height=40, width=56)):
        Image.fromarray(image).save(folder / f"{k:03d}.png")
    options = (*SIZED, "--model", model_folder, "--anyway")
    assert (
        answer(folder, "--sequence-fps", "25", *options)["quantities"]
        == answer(film, *options)["quantities"]
    )


def test_a_refused_film_ends_with_3_and_shows_no_estimate(strange: Path, tmp_path: Path) -> None:
    page = tmp_path / "report.html"
    done = run(strange, *SIZED, "--report", page, code=3)
    words = re.sub(r"data:image/[^\"]*", "", page.read_text())
    assert "m/s" not in done.out + words
    assert re.search(r"noise of [\d.]+ gray levels", done.err)
    assert "also: " in done.err
    assert "Refused" in page.read_text()
    error = json.loads(run(strange, *SIZED, "--json", code=3).out)
    assert error["kind"] == "refused"
    marked = run(strange, *SIZED, "--anyway")
    assert marked.out.startswith("refused by the gate, not to be relied on: ")


@pytest.mark.parametrize("form", [(), ("--json",), ("--csv",)])
def test_a_still_film_is_given_no_number_even_anyway(tmp_path: Path, form: tuple[str, ...]) -> None:
    still = write_video(tmp_path / "still.mkv", pictures(1, height=40, width=56).repeat(40, axis=0))
    done = run(still, *SIZED, "--anyway", *form, code=3)
    assert (
        "no number is given, not even with --anyway: no motion is found in the picture"
        in done.out + done.err
    )
    assert "m/s" not in done.out + done.err
    assert not form or "quantities" not in done.out


def test_the_report_is_one_file_that_refers_to_no_other(
    film: Path, model_folder: Path, tmp_path: Path
) -> None:
    page = tmp_path / "report.html"
    run(film, *SIZED, "--model", model_folder, "--anyway", "--report", page)
    text = page.read_text()
    assert not re.search(r'(src|href)="(?!data:|#)', text)
    assert text.count("data:image/webp") == 1
    assert text.count("<svg") == 2


def test_a_crop_beyond_the_picture_is_refused_and_one_inside_changes_the_answer(
    film: Path, model_folder: Path
) -> None:
    options = (*SIZED, "--model", model_folder, "--anyway")
    assert "reaches beyond" in run(film, *options, "--crop", "30,0,30,30", code=2).err
    whole, part = answer(film, *options), answer(film, *options, "--crop", "0,0,30,30")
    assert whole["quantities"] != part["quantities"]


def test_a_recording_is_measured_once_with_its_parents(lake: Path, model_folder: Path) -> None:
    options = ("--lake", lake, *SIZED, "--model", model_folder, "--anyway", "--seed", "5")
    first, again = answer("made-1", *options), answer("made-1", *options)
    rows = measurements(lake)
    assert [row["artifact"] for row in rows] == [first["artifact"]]
    assert again["artifact"] == first["artifact"]
    assert rows[0]["parents"] == [first["source"]]
    assert rows[0]["seed"] == 5
    stored, arrays = read(Lake.open(lake).object_path(str(rows[0]["object"])))
    assert stored["quantities"] == first["quantities"]
    assert arrays["draws"].shape[1] == 4
    np.testing.assert_allclose(arrays["anemometer"], 4.0)
    assert answer("made-1", *options, "--level", "0.8")["artifact"] != first["artifact"]
    assert len(measurements(lake)) == 2


def test_a_recording_measured_by_newer_code_is_a_new_version_of_the_measurement(
    lake: Path, model_folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    options = ("--lake", lake, *SIZED, "--model", model_folder, "--anyway")
    first = answer("made-1", *options)
    monkeypatch.setattr("flagdata.core.provenance.code_version", lambda: "0.1.0+mended")
    done = run("made-1", *options)
    assert (
        f"committed as version 2 of 'made-1'; version 1, {str(first['artifact'])[:12]}, is by code "
        in done.err
    )
    old, new = measurements(lake)
    assert (old["artifact"], new["code_version"]) == (first["artifact"], "0.1.0+mended")
    assert new["parents"] == old["parents"]


def test_a_recording_in_a_bucket_is_measured_by_its_parts_as_in_a_folder(
    lake: Path,
    model_folder: Path,
    bucket_folder: str,
    monkeypatch: pytest.MonkeyPatch,
    tmp_path: Path,
) -> None:
    options = (*SIZED, "--model", model_folder, "--anyway", "--seed", "5")
    expected = answer("made-1", "--lake", lake, "--read-only", *options)
    remote, _ = clone(Lake.open(lake), bucket_folder, bars=progress)
    monkeypatch.setattr(objects, "WHOLE", 0)
    shutil.rmtree(tmp_path / "cache", ignore_errors=True)
    found = answer("made-1", "--lake", bucket_folder, *options)
    assert found["quantities"] == expected["quantities"]
    assert [row["artifact"] for row in remote.rows("kind = 'measurement'").to_pylist()] == [
        found["artifact"]
    ]
    assert list((tmp_path / "cache" / "objects").glob("*.blocks/*"))  # no whole record was fetched
    stored, _ = read(remote.object_path(str(remote.artifact(str(found["artifact"])).object)))
    assert stored["quantities"] == expected["quantities"]


def test_a_network_of_the_lake_is_a_parent_of_what_it_measured(
    lake: Path, model_folder: Path
) -> None:
    with Lake.open(lake).transaction("a network") as transaction:
        network = Artifact(
            kind=Kind.NETWORK,
            name="small-net",
            object=transaction.put(_as_model(model_folder, lake)),
        )
        transaction.add(network)
    found = answer("made-1", "--lake", lake, *SIZED, "--model", "small-net", "--anyway")
    assert measurements(lake)[0]["parents"] == [found["source"], network.id]


def _as_model(folder: Path, lake: Path) -> Path:
    target = lake.parent / "copy.model"
    target.mkdir()
    for entry in folder.iterdir():
        (target / entry.name).write_bytes(entry.read_bytes())
    return target


def test_the_nearest_simulated_clips_are_those_of_other_recordings(
    lake: Path, model: Estimator
) -> None:
    opened = Lake.open(lake)
    first, other = opened.rows("kind = 'recording'").to_pylist()
    record_ = Record.open(opened.object_path(first["object"]))
    film = condition_film(record_.frames(0, FRAMES), np.arange(FRAMES) / RATE).frames
    with torch.no_grad():
        summary = model.embeddings(model.inputs(film[None]))[0][0].numpy()
    found, compared = nearest(opened, model, summary, without=None, at=None, seed=0)
    assert found[0].distance == pytest.approx(0, abs=1e-4)
    np.testing.assert_array_equal(found[0].frames, film)
    assert found[0].distance <= found[1].distance <= found[2].distance
    rest, fewer = nearest(opened, model, summary, without=first["artifact"], at=None, seed=0)
    assert (compared, fewer) == (6, 3)
    clips = opened.rows(f"kind = 'clip' and recording = '{other['artifact']}'")[
        "artifact"
    ].to_pylist()
    assert {one.artifact for one in rest} == set(clips)
    assert rest[0].known["area_weight"] == 0.12


def test_reading_only_adds_nothing_to_the_lake(lake: Path, model_folder: Path) -> None:
    found = answer(
        "made-1", "--lake", lake, *SIZED, "--model", model_folder, "--anyway", "--read-only"
    )
    assert found["artifact"] is None
    assert not measurements(lake)


def test_a_refused_recording_leaves_no_measurement(lake: Path, film: Path) -> None:
    run("made-1", "--lake", lake, *SIZED, "--false-alarm", "0.99", code=3)
    assert not measurements(lake)


def test_a_query_measures_each_clip(lake: Path, model_folder: Path) -> None:
    options = ("--lake", lake, *SIZED, "--model", model_folder, "--anyway")
    found = answer("--query", "wind between 3 and 5 and seed = 1", *options)["measurements"]
    clips = (
        Lake.open(lake)
        .rows("kind = 'clip' and seed = 1", columns=["artifact"])["artifact"]
        .to_pylist()
    )
    assert sorted(one["source"] for one in found) == sorted(clips)  # type: ignore[union-attr, index]
    assert {one["simulated_with"]["wind_speed"] for one in found} == {4.0}  # type: ignore[union-attr, index]
    assert "no clip matches" in run("--query", "wind > 90", *options, code=1).err


def test_a_clip_is_its_part_of_the_recording(lake: Path, model_folder: Path) -> None:
    clip = Lake.open(lake).rows("kind = 'clip' and seed = 1").to_pylist()[1]
    options = ("--lake", lake, *SIZED, "--model", model_folder, "--anyway", "--read-only")
    begin = clip["frame_first"] / RATE
    part = ("--start", f"{begin}s", "--end", f"{begin + (FRAMES + 1) / RATE}s")
    own, cut = answer(clip["artifact"], *options), answer("made-1", *options, *part)
    # Two frames about the part belong to the sample from which its still background is made.
    for name, quantity in own["quantities"].items():  # type: ignore[union-attr]
        assert quantity["interval"] == pytest.approx(cut["quantities"][name]["interval"], rel=5e-3)  # type: ignore[index]


def test_a_wind_series_is_a_table_and_a_data_set(
    lake: Path, model_folder: Path, tmp_path: Path
) -> None:
    import xarray

    target = tmp_path / "series.zarr"
    done = run(
        "made-1",
        "--lake",
        lake,
        *SIZED,
        "--model",
        model_folder,
        "--anyway",
        "--windows",
        "0.24s",
        "--csv",
        "--zarr",
        target,
    )
    rows = list(csv.DictReader(io.StringIO(done.out)))
    assert len(rows) == 7
    assert {float(row["anemometer"]) for row in rows} == {4.0}
    with xarray.open_zarr(target, consolidated=False) as data:
        winds = [float(row["wind"]) for row in rows]
        np.testing.assert_allclose(data["wind_speed"], winds, rtol=1e-3)
        assert data["wind_speed"].attrs["units"] == "m/s"
        assert data["wind_speed_draws"].dims == ("draw",)
        assert set(data.coords) == {"start", "end", "time"}
        assert data["time"].dtype.kind == "M"
        assert data.attrs["document"]["film"] == data.attrs["subject"] == "made-1"


@pytest.mark.parametrize(
    ("arguments", "code", "words"),
    [
        ((), 2, "name a film"),
        (("nothing.mp4",), 1, "no lake was named"),
        (("FILM", "--query", "true"), 2, "one of them"),
        (("FILM", "--flag-size", "large"), 2, "metres"),
        (("FILM", "--flag-size", "0.2x0.1"), 3, "needs"),
        (("FILM", "--model", "wove"), 2, "did you mean 'wave'"),
        (("FILM", "--start", "20s"), 2, "not in the film, which lasts"),
        (("FILM", "--crop", "whole"), 2, "not a box"),
        (("FILM", "--json", "--csv"), 2, "more than one form"),
        (("FILM", "--refine", "28"), 2, "whose size is not known"),
        (("FILM", "--cache", "clips"), 2, "--cache needs --refine"),
        (
            ("--query", "true", "--flag-size", "1.5x1.0", "--refine", "28", "--lake", "LAKE"),
            2,
            "is of one film",
        ),
        (("FILM", "--report", "nowhere/report.html"), 1, "create it first"),
        (("FILM", "--lake", "nowhere"), 1, "no lake here"),
    ],
)
def test_what_cannot_be_measured_is_an_error_with_a_fix(
    film: Path, lake: Path, arguments: tuple[str, ...], code: int, words: str
) -> None:
    named = {"FILM": str(film), "LAKE": str(lake)}
    done = run(*(named.get(argument, argument) for argument in arguments), code=code)
    assert words in done.err
    assert "fix:" in done.err


def test_a_text_file_is_no_film(tmp_path: Path) -> None:
    path = tmp_path / "notes.txt"
    path.write_text("no film")
    assert "fix:" in run(path, code=1).err


def test_a_hanging_cloth_is_measured_by_a_model_of_it(film: Path, cloth_folder: Path) -> None:
    found = answer(film, "--model", cloth_folder, "--flag-size", "1.0x1.0", "--anyway")
    assert set(found["quantities"]) == {"wind_speed", "area_weight", "bending_scale"}  # type: ignore[call-overload]
    assert found["model"] == "small-cloth"


def test_a_hanging_cloth_is_not_refined_by_simulating_flags(film: Path, cloth_folder: Path) -> None:
    said = run(
        film,
        "--model",
        cloth_folder,
        "--flag-size",
        "1.0x1.0",
        "--anyway",
        "--refine",
        "28",
        "--json",
        code=2,
    )
    assert "hanging-cloth" in said.out + said.err


def refused_by_the_disk(*_: object, **__: object) -> NoReturn:
    raise OSError(errno.EIO, "Input/output error")


def test_a_measurement_that_is_committed_is_reported_whatever_becomes_of_its_files(
    lake: Path, model_folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Each file that the disk refuses is a warning of its own; without a commit it is an error."""
    monkeypatch.setattr("flagdata.core.files.outputs.fresh_folder", refused_by_the_disk)
    monkeypatch.setattr("flagdata.core.files.outputs.write_file", refused_by_the_disk)
    files = ("--report", tmp_path / "report.html", "--zarr", tmp_path / "series.zarr")
    options = (
        "made-1",
        "--lake",
        lake,
        *SIZED,
        "--model",
        model_folder,
        "--anyway",
        *files,
        "--json",
    )
    done = run(*options)
    assert json.loads(done.out)["artifact"] == measurements(lake)[0]["artifact"]
    for what in ("its Zarr folder", "its report"):
        assert (
            f"is published, but writing {what} failed: the system refused: Input/output error"
            in done.err
        )
    run(*options, "--read-only", code=1)


def test_what_a_report_shows_is_read_before_the_commit(
    lake: Path, model_folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("measure.estimate.nearest.nearest", refused_by_the_disk)
    options = ("made-1", "--lake", lake, *SIZED, "--model", model_folder, "--anyway")
    run(*options, "--report", tmp_path / "report.html", code=1)
    assert measurements(lake) == []
