"""A build: complete, loadable like real data, and the same whatever was killed on the way."""

from __future__ import annotations

import json
import pickle
import shutil
from collections import Counter
from collections.abc import Callable, Iterable, Iterator
from contextlib import AbstractContextManager, nullcontext
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import flagdata
from flagdata.dataset import ExplicitSplit
from flagdata.errors import ConflictError, FlagdataError, RefusedError
from flagdata.lake import Lake, doctor, object_names, verify
from flagdata.record import Record
from sim.datasets import DatasetRecipe
from sim.datasets.build import Build, BuildReport
from sim.datasets.build_jobs import PutSequences
from sim.datasets.build_plan import length
from sim.datasets.shard import Shard
from sim.workers import Job, Scheduled
from tests.clusters import Cluster
from tests.program import invoke
from tests.small import GROUPS

SIDES = {side: {"dataset": "tiny", "side": side} for side in ("train", "test")}
SEQUENCES, FILMS = 5, 10


def test_a_build_holds_what_its_recipe_says(built: Path, report: dict[str, Any]) -> None:
    assert report["schema"] == "flagdata.build/1"
    assert (report["new_sequences"], report["new_films"], report["clips"]) == (
        SEQUENCES,
        FILMS,
        FILMS,
    )
    assert Path(report["card"]).parent == built / "cards"
    lake = Lake.open(built)
    rows = lake.rows().to_pylist()
    assert Counter(row["kind"] for row in rows) == {
        "meshes": SEQUENCES,
        "recording": FILMS,
        "clip": FILMS,
    }
    for side, sequences, films in (("train", 3, 7), ("test", 2, 3)):
        own = [
            row
            for row in rows
            if row["kind"] == "recording" and row["name"].startswith(f"tiny-{side}-")
        ]
        often = Counter(row["seed"] for row in own)
        assert len(own) == films
        assert len(often) == sequences
        assert max(often.values()) - min(often.values()) <= 1
        assert sorted(row["name"] for row in own) == [
            f"tiny-{side}-{place:05d}" for place in range(films)
        ]
    assert [finding for finding in doctor(lake) if finding.severity != "note"] == []
    assert verify(lake, object_names(lake)) == ()


def test_clips_load_as_real_ones_do_with_the_simulated_wind_as_their_truth(built: Path) -> None:
    lake = Lake.open(built)
    winds = {row["seed"]: row["wind"] for row in lake.rows("kind = 'meshes'").to_pylist()}
    source = flagdata.open(built)
    seen: dict[str, set[int | None]] = {}
    for side in SIDES:
        pairs = source.pairs(split=side, split_by=ExplicitSplit(where=SIDES))
        assert pairs.refused == ()
        for index in range(len(pairs)):
            sample = pairs[index]
            seen.setdefault(side, set()).add(sample.seed)
            assert sample.clip.shape == (1, 30, 32, 32)
            assert sample.wind == winds[sample.seed]
            assert (sample.wind_sigma, sample.clock_sigma, sample.coverage) == (0.0, 0.0, 1.0)
            assert 0.10 <= sample.parameters["area_weight"] <= 0.17
            assert {f"bending.{i}" for i in range(15)} < set(sample.parameters)
            assert sample.parameters["render.width"] == 32
    assert not seen["train"] & seen["test"]
    batch = next(iter(source.pairs().loader(4)))
    assert batch.clip.shape == (4, 1, 30, 32, 32)


def test_a_films_anemometer_is_a_log_of_its_wind_at_1_hz(built: Path) -> None:
    lake = Lake.open(built)
    for row in lake.rows("kind = 'recording'").to_pylist():
        record = Record.open(lake.object_path(row["object"]))
        series, truth = record.wind(), record.truth
        assert series is not None
        assert truth is not None
        np.testing.assert_array_equal(np.diff(series.time), 10**9)
        assert series.time[-1] <= record.frame_times[-1]
        assert record.frame_times[0] - series.time[0] > 60 * 10**9
        expected = truth["wind_speed"] * truth["anemometer-gain.gain"]
        # Noise of 0.1 m/s over some 75 samples: 5 standard errors and half a step; near 0, readings
        # are cut off.
        assert np.mean(series.channels["wind_speed"]) == pytest.approx(expected, abs=0.06 + 0.05)
        parameters = json.loads(row["parameters"])
        assert {
            name: value for name, value in parameters.items() if not isinstance(value, str)
        } == truth
        assert parameters["material"] == "camel-ponte-roma"


@pytest.fixture
def beside_bucket(bucket_folder: str, tmp_path: Path) -> Iterator[Cluster]:
    """Two workers that have the bucket's address and keys."""
    (tmp_path / "dask").mkdir()
    running = Cluster(tmp_path / "dask", workers=2)
    try:
        yield running
    finally:
        running.close()


def test_a_build_into_a_bucket_of_which_a_worker_is_preempted_makes_the_rows_of_one_in_a_folder(
    recipe_file: Path,
    builds: Any,
    built: Path,
    bucket_folder: str,
    beside_bucket: Cluster,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """What the workers make goes from them into the bucket; the client sends jobs and gets rows."""
    plain, passed = Scheduled.results, []

    def counted(workers: Scheduled, jobs: Iterable[Job]) -> Iterator[Any]:
        def sent() -> Iterator[Job]:
            for job in jobs:
                passed.append(len(pickle.dumps(job)))
                yield job

        for number, result in enumerate(plain(workers, sent())):
            passed.append(len(pickle.dumps(result)))
            if number == FILMS // 2:
                beside_bucket.workers[0].terminate()
            yield result

    monkeypatch.setattr(Scheduled, "results", counted)
    done = type(builds)(beside_bucket, tmp_path / "said").build(recipe_file, bucket_folder)
    assert done.exit_code == 0, done
    assert beside_bucket.workers[0].wait(timeout=60) is not None
    assert builds.rows(bucket_folder) == builds.rows(built)
    lake = Lake.open(bucket_folder)
    assert verify(lake, object_names(lake)) == ()
    stored = sum(one.size for one in lake.objects)
    assert len(passed) >= 2 * (FILMS + 3)
    # Jobs and rows have the recipe's length: 20 kB a film, of which one of flagsim-small has 2.8 MB
    # and these 0.1.
    assert sum(passed) < min(stored / 2, 20_000 * len(passed))


def test_shards_on_branches_merged_are_the_whole_build(
    recipe_file: Path, built: Path, builds: Any, tmp_path: Path
) -> None:
    lake = Lake.create(tmp_path / "lake")
    made: list[dict[str, Any]] = []
    for number in (1, 2):
        lake.branch(f"part-{number}")
        where = ("--lake", lake.path, "--branch", f"part-{number}", "--workers", 1, "--json")
        made.append(invoke("build", recipe_file, "--shard", f"{number}/2", *where).document)
    assert [part["card"] for part in made] == [None, None]
    assert sum(part["new_sequences"] for part in made) == SEQUENCES
    assert sum(part["new_films"] for part in made) == FILMS
    assert all(part["new_films"] == part["films"] for part in made)
    assert all(part["films"] for part in made)
    for number in (1, 2):
        assert invoke("merge", f"part-{number}", "--lake", lake.path).code == 0
    whole = invoke("build", recipe_file, "--lake", lake.path, "--workers", 1, "--json").document
    assert (whole["new_sequences"], whole["new_films"]) == (0, 0)
    assert whole["card"]
    assert builds.rows(lake.path) == builds.rows(built)


def without_bars(*_: object) -> AbstractContextManager[Callable[[int], None]]:
    return nullcontext(lambda _: None)


class FirstFails:
    """Work in this process, of which the first sequence of every cast comes to nothing."""

    count = 1

    def __init__(self) -> None:
        self.jobs = 0

    def results(self, jobs: Iterable[Job]) -> Iterator[Any]:
        for function, arguments in jobs:
            self.jobs += 1
            done = function(*arguments)
            if isinstance(done, PutSequences) and 0 in done.stored:
                others = {index: stored for index, stored in done.stored.items() if index != 0}
                done = replace(done, stored=others, failed={0: "it crumpled"})
            yield done


def test_shards_of_which_each_replaces_a_sequence_that_failed_are_the_whole_build(
    make: Callable[..., DatasetRecipe], builds: Any, tmp_path: Path
) -> None:
    recipe = make({"[sides.train]": GROUPS + "[sides.train]"})

    def build(lake: Lake, branch: str = "main", shard: Shard | None = None) -> BuildReport:
        return Build(
            lake=lake,
            recipe=recipe,
            workers=FirstFails(),
            bars=without_bars,
            branch=branch,
            shard=shard,
        ).run()

    parts, together, whole = (
        Lake.create(tmp_path / name) for name in ("parts", "together", "whole")
    )
    for number in (1, 2):
        parts.branch(f"part-{number}")
        assert build(parts, f"part-{number}", Shard(number=number, of=2)).failed
        build(together, shard=Shard(number=number, of=2))
    for number in (1, 2):
        assert invoke("merge", f"part-{number}", "--lake", parts.path).code == 0
    for lake in (parts, together):
        assert (build(lake).new_sequences, build(lake).new_films) == (0, 0)
    report = build(whole)
    assert (report.new_sequences, report.new_films) == (SEQUENCES, FILMS)
    assert len(report.failed) == 3
    assert builds.rows(parts.path) == builds.rows(together.path) == builds.rows(whole.path)


def test_a_build_given_again_knows_what_failed_and_simulates_nothing(
    make: Callable[..., DatasetRecipe], tmp_path: Path
) -> None:
    recipe, lake = make(), Lake.create(tmp_path / "lake")
    first = Build(lake=lake, recipe=recipe, workers=FirstFails(), bars=without_bars).run()
    assert length(recipe, lake, workers=1) is None
    workers = FirstFails()
    again = Build(lake=lake, recipe=recipe, workers=workers, bars=without_bars).run()
    assert workers.jobs == 0
    assert again.failed == first.failed
    assert len(first.failed) == 2
    meshes = lake.rows("kind = 'meshes'", columns=["name", "report"]).to_pylist()
    named = {row["name"]: json.loads(row["report"]).get("in_place_of") for row in meshes}
    assert {name for name, members in named.items() if members} == {
        "tiny-train-00003",
        "tiny-test-00002",
    }
    assert named["tiny-test-00002"] == {"0": "it crumpled"}


def test_a_shard_heals_an_object_beside_a_sequence_that_was_replaced_before(
    make: Callable[..., DatasetRecipe], tmp_path: Path
) -> None:
    recipe, lake = make(), Lake.create(tmp_path / "lake")
    Build(lake=lake, recipe=recipe, workers=FirstFails(), bars=without_bars).run()
    for row in lake.rows("kind = 'meshes'", columns=["object"]).to_pylist():
        shutil.rmtree(lake.object_path(row["object"]))
    shards = (Shard(number=number, of=2) for number in (1, 2))
    made = [
        Build(lake=lake, recipe=recipe, workers=FirstFails(), bars=without_bars, shard=one).run()
        for one in shards
    ]
    assert sum(report.healed for report in made) == SEQUENCES


def test_shards_of_two_recipes_of_one_name_are_not_mixed_where_they_film_one_flag(
    make: Callable[..., DatasetRecipe], tmp_path: Path
) -> None:
    lake = Lake.create(tmp_path / "lake")
    grouped = {"[sides.train]": GROUPS + "[sides.train]"}
    first, second = make(grouped), make({**grouped, "read-noise = 1.0": "read-noise = 2.0"})
    Build(
        lake=lake,
        recipe=first,
        workers=FirstFails(),
        bars=without_bars,
        shard=Shard(number=1, of=2),
    ).run()
    with pytest.raises(ConflictError, match="are of another recipe"):
        Build(
            lake=lake,
            recipe=second,
            workers=FirstFails(),
            bars=without_bars,
            shard=Shard(number=2, of=2),
        ).run()


def test_a_shard_refuses_to_replace_a_sequence_where_that_changes_films_of_other_shards(
    make: Callable[..., DatasetRecipe], tmp_path: Path
) -> None:
    lake = Lake.create(tmp_path / "lake")
    with pytest.raises(
        RefusedError, match="sequence 0 failed, and a shard cannot choose another: it crumpled"
    ):
        Build(
            lake=lake,
            recipe=make(),
            workers=FirstFails(),
            bars=without_bars,
            shard=Shard(number=1, of=2),
        ).run()


def test_the_card_says_what_was_built(built: Path, make: Callable[..., DatasetRecipe]) -> None:
    (card,) = (built / "cards").iterdir()
    text = card.read_text()
    assert make().hash in text
    assert "CC0-1.0" in text
    assert "<pre>import flagdata\nfrom flagdata.dataset import ExplicitSplit" in text
    assert "data:image/jpeg;base64," in text
    for name in ("wind_speed", "area_weight", "camera_radius", "anemometer-lag.distance", "flag/"):
        assert name in text
    assert '<th scope="row">train</th><td>3</td><td>–</td><td>7</td><td>7</td>' in text
    assert text.index(">bending.2<") < text.index(">bending.10<")
    assert "The same in all films: " in text


def test_two_recipes_of_one_name_are_not_mixed(
    recipe_file: Path, builds: Any, built: Path, tmp_path: Path
) -> None:
    # A side is what the catalog states of it: a changed recipe must have another name, or a branch
    # of its own.
    (tmp_path / "scene.toml").write_text((recipe_file.parent / "scene.toml").read_text())
    changed = tmp_path / "tiny.toml"
    changed.write_text(recipe_file.read_text().replace("read-noise = 1.0", "read-noise = 2.0"))
    before = builds.rows(built)
    refused = builds.build(changed, built).exception
    assert isinstance(refused, FlagdataError)
    assert "are of another recipe" in refused.what
    assert builds.rows(built) == before


def test_a_build_that_is_killed_twice_and_loses_a_worker_ends_as_an_unbroken_one(
    recipe_file: Path, builds: Any, cluster: Any, built: Path, tmp_path: Path
) -> None:
    """Killed among its sequences and among its films; then the other worker does a killed one's
    jobs."""
    lake = tmp_path / "lake"
    for artifacts in (2, SEQUENCES + 4):
        builds.kill(builds.start(recipe_file, lake, pause=artifacts))
    process = builds.start(recipe_file, lake, pause=SEQUENCES + 6)
    cluster.workers[0].kill()
    builds.finish(process)
    assert builds.rows(lake) == builds.rows(built)
    version = Lake.open(lake).resolve(None)
    assert builds.build(recipe_file, lake).exit_code == 0  # nothing is made again
    assert Lake.open(lake).resolve(None) == version


def test_a_build_ends_without_workers_and_without_its_scheduler_and_goes_on_when_there_are_some(
    recipe_file: Path, cluster: Any, built: Path, builds: Any, tmp_path: Path
) -> None:
    """The last test: it ends the cluster."""
    lake = tmp_path / "lake"
    process = builds.start(recipe_file, lake, pause=SEQUENCES)
    for worker in cluster.workers:
        worker.kill()
    said = builds.refused(process)
    assert "all workers are gone; waiting 2 s for new ones" in said
    assert "no workers for 2 s" in said
    assert "it goes on from what is kept" in said
    kept = builds.rows(lake)
    assert len(kept) > SEQUENCES
    cluster.add_worker()
    process = builds.start(recipe_file, lake, pause=len(kept))
    cluster.scheduler.kill()
    said = builds.refused(process)
    assert "the scheduler is gone" in said
    assert "it goes on from what is kept" in said
    assert kept.items() < builds.rows(lake).items() <= builds.rows(built).items()
