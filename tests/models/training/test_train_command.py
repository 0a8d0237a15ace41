"""`flagdata train` and `flagdata evaluate` on a small lake: artifacts, provenance, what is
refused."""

from __future__ import annotations

import json
import os
import re
import shutil
import socket
import subprocess
import sys
import time
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path
from typing import Any, NoReturn

import numpy as np
import pytest
import torch
from click.testing import CliRunner

import flagdata
from flagdata.cli import root
from flagdata.core.files.file_locks import alone_in
from flagdata.errors import (
    ConflictError,
    CorruptError,
    FlagdataError,
    InputError,
    NotFoundError,
    UnknownNameError,
    UsageError,
)
from flagdata.lake import Catalog, Lake
from models.networks.targets import Cloth
from models.trained import estimator
from models.trained.model_folder import WEIGHTS, read_card
from models.training import (
    inputs,
    load,
    parse,
    prepare_clips,
    prepare_films,
    sides_of,
    train_command,
)
from models.training.inputs import clip_as_taken
from models.training.stated_films import StatedFilms
from models.training.training_recipe import TRAININGS
from tests.small import TRAINING
from tests.studies import shipping
from tests.studies.yardsticks.command import yardsticks


def run(*arguments: str) -> dict[str, Any]:
    done = CliRunner().invoke(root, [*arguments, "--json"], catch_exceptions=False)
    assert done.exit_code == 0, done.output
    return json.loads(done.stdout)


@pytest.fixture(scope="module")
def lake(lake_path: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A copy that models are committed to: two seeds of the small recipe."""
    path = tmp_path_factory.mktemp("trained") / "lake"
    shutil.copytree(lake_path, path)
    recipe = path.parent / "small.toml"
    recipe.write_text(TRAINING)
    orders = set()
    for seed in (1, 2):
        done = CliRunner().invoke(
            root,
            [
                "train",
                str(recipe),
                "--at",
                "v1",
                "--seed",
                str(seed),
                "--lake",
                str(path),
                "--workers",
                "1",
            ],
            catch_exceptions=False,
        )
        orders |= set(
            re.findall(r"^order of the first epoch: ([0-9a-f]{64})$", done.stderr, re.MULTILINE)
        )
    assert len(orders) == 2
    return path


def test_a_model_is_an_artifact_with_what_it_came_from(lake: Path) -> None:
    rows = Lake.open(lake).rows("kind = 'network'").to_pylist()
    assert [row["name"] for row in rows] == ["small", "small"]
    assert sorted(row["seed"] for row in rows) == [1, 2]
    card = read_card(Lake.open(lake).object_path(rows[0]["object"]))
    pairs = sides_of(flagdata.open(lake), load(str(lake.parent / "small.toml")), "train", at="v1")
    assert card["data"]["at"] == "v1"
    assert card["data"]["train"] == pairs.fingerprint
    assert card["recipe_hash"]
    assert card["code_version"]
    assert card["batches"]["epoch"] == card["epochs"] == 3
    assert not list(Lake.open(lake).object_path(rows[0]["object"]).glob("*.pt"))


def test_a_model_has_the_page_of_its_training_with_clips_their_truth_and_what_it_reads(
    lake: Path,
) -> None:
    opened = Lake.open(lake)
    (row, _) = opened.rows("kind = 'network'").to_pylist()
    folder = opened.object_path(row["object"])
    page = (folder / "training.html").read_text(encoding="utf-8")
    assert "small misses the wind speed of clips that validate by" in page
    shown = re.findall(r"true (-?[\d.]+) m/s, estimated (-?[\d.]+) \[", page)
    assert 2 <= len(shown) <= 6
    assert [float(true) for true, _ in shown] == sorted(float(true) for true, _ in shown)
    assert page.count("data:image/webp;base64,") == len(shown)
    assert page.count("<svg ") == 2
    best = read_card(folder)["best"]
    assert f"epoch {best['number'] + 1} of 3 was the best" in page


def test_a_model_was_made_from_the_recordings_of_both_sides(
    lake: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    opened = Lake.open(lake)
    recipe = load(str(lake.parent / "small.toml"))
    source = flagdata.open(lake)
    train, validation = (
        sides_of(source, recipe, side, at="v1") for side in ("train", "validation")
    )
    clips = {*train.table.artifact.tolist(), *validation.table.artifact.tolist()}
    catalog = opened.rows(at="v1", columns=["artifact", "recording"]).to_pylist()
    made_from = {row["recording"] for row in catalog if row["artifact"] in clips}
    model = opened.rows({"kind": "network"}).to_pylist()[0]
    assert set(model["parents"]) == made_from
    monkeypatch.setattr(train_command, "PARENTS", 2)
    data = train_command.data_identity(opened, train, validation, at="v1")
    bounded = train_command.network_artifact(
        opened,
        recipe,
        data,
        [*train_command.recordings_of(train, validation), "f" * 32],
        branch="main",
    )
    assert bounded.parents == tuple(sorted(made_from)[:2])
    assert bounded.recipe["recordings"] == len(made_from) + 1


def test_training_again_changes_nothing(lake: Path) -> None:
    before = Lake.open(lake).rows().num_rows
    report = run("train", str(lake.parent / "small.toml"), "--at", "v1", "--lake", str(lake))
    assert report["seed"] == 1
    assert Lake.open(lake).rows().num_rows == before


def test_the_call_returns_the_answer_that_the_command_prints_with_curves_and_clips(
    lake: Path,
) -> None:
    recipe = str(lake.parent / "small.toml")
    answer = flagdata.train(recipe, lake=str(lake), at="v1", workers=1)
    printed = run("train", recipe, "--at", "v1", "--lake", str(lake))
    assert answer.document == {key: printed[key] for key in printed if key != "schema"}
    folder = Lake.open(lake).object_path(answer.document["object"])
    course = read_card(folder)["course"]
    found = answer.to_xarray()
    assert found["epoch"].values.tolist() == [1, 2, 3]
    for name, key in (("training_loss", "train"), ("validation_loss", "validation")):
        assert found[name].values.tolist() == [epoch[key] for epoch in course]
    assert found["true"].attrs["units"] == "m/s"
    difference = found["estimated"] - found["true"]
    rmse = answer.quantities["rmse"]
    assert rmse.value == pytest.approx(float((difference**2).mean()) ** 0.5)
    assert f"{rmse.value:.3g} m/s" in answer.sentence
    assert (found["estimated_low"] <= found["estimated_high"]).all()
    assert re.findall(r"true (-?[\d.]+) m/s", answer.page)


_RANK = """
import json, os, sys
from pathlib import Path
import flagdata
recipe, lake, out = sys.argv[1:]
answer = flagdata.train(recipe, lake=lake, at="v1", seed=8, workers=1)
kept = {"document": answer.document, "page": answer.page}
Path(out, os.environ["RANK"]).write_text(json.dumps(kept))
"""


def test_each_process_of_a_torchrun_returns_the_answer_and_the_command_of_the_first_prints(
    lake: Path, tmp_path: Path
) -> None:
    own, out = tmp_path / "lake", tmp_path / "out"
    shutil.copytree(lake, own)
    out.mkdir()
    recipe = str(lake.parent / "small.toml")
    command = [recipe, "--lake", str(own), "--at", "v1", "--seed", "8", "--json"]

    def run_ranks(*arguments: str) -> list[str]:
        with socket.create_server(("127.0.0.1", 0)) as free:
            port = str(free.getsockname()[1])
        place = {"MASTER_ADDR": "127.0.0.1", "MASTER_PORT": port, "WORLD_SIZE": "2"}
        processes = [
            subprocess.Popen(
                [sys.executable, *arguments],
                env=os.environ | place | {"RANK": str(rank), "OMP_NUM_THREADS": "1"},
                stdout=subprocess.PIPE,
                text=True,
            )
            for rank in range(2)
        ]
        texts = [process.communicate(timeout=500)[0] for process in processes]
        assert [process.returncode for process in processes] == [0, 0]
        return texts

    run_ranks("-c", _RANK, recipe, str(own), str(out))
    first, second = (json.loads((out / rank).read_text()) for rank in "01")
    assert first == second
    assert Lake.open(own).artifact(first["document"]["artifact"]).seed == 8
    printed, nothing = run_ranks("-m", "flagdata.cli", "train", *command)
    assert nothing == ""
    assert json.loads(printed)["artifact"] == first["document"]["artifact"]


def test_a_model_of_an_earlier_version_answers_without_the_clips_that_validated(
    lake: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    row = Lake.open(lake).rows("kind = 'network'").to_pylist()[0]
    folder = tmp_path / "model"
    shutil.copytree(Lake.open(lake).object_path(row["object"]), folder)
    (folder / "judged.safetensors").unlink()
    monkeypatch.setattr(Lake, "object_path", lambda *_: folder)
    recipe = str(lake.parent / "small.toml")
    answer = flagdata.train(recipe, lake=str(lake), at="v1", seed=row["seed"])
    assert "small is trained; epoch" in answer.sentence
    assert not answer.quantities
    assert len(answer.arrays["epoch"].values) == 3


def test_a_model_that_is_committed_is_reported_without_reading_the_lake_again(
    lake: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A catalog that cannot be read once the model is in it."""
    append = Catalog.append

    def then_unreadable(*arguments: Any, **options: Any) -> int:
        version = append(*arguments, **options)
        for name in ("head", "rows"):
            monkeypatch.setattr(Catalog, name, unreadable)
        return version

    def unreadable(*_: object) -> NoReturn:
        raise CorruptError("the catalog cannot be read", fix="check the disk")

    monkeypatch.setattr(Catalog, "append", then_unreadable)
    report = run(
        "train", str(lake.parent / "small.toml"), "--at", "v1", "--seed", "3", "--lake", str(lake)
    )
    monkeypatch.undo()
    row = Lake.open(lake).artifact(report["artifact"])
    assert (row.seed, row.object) == (3, report["object"])
    Lake.open(lake).withdraw([row.id], "of another test")


def test_models_are_judged_with_intervals_over_simulations(lake: Path, tmp_path: Path) -> None:
    found = run(
        "evaluate",
        "small",
        "--dataset",
        "made",
        "--at",
        "main",
        "--lake",
        str(lake),
        "--out",
        str(tmp_path),
    )
    assert (tmp_path / "evaluation.html").stat().st_size > 1000
    text = json.dumps(found)
    assert '"small"' in text
    assert '"rmse"' in text


def test_networks_are_of_today_and_the_clips_of_a_version_that_is_older(
    lake: Path, tmp_path: Path
) -> None:
    found = run(
        "evaluate",
        "small",
        "--dataset",
        "made",
        "--at",
        "v1",
        "--lake",
        str(lake),
        "--out",
        str(tmp_path),
    )
    assert not Lake.open(lake).rows("kind = 'network'", at="v1").num_rows
    assert [row["label"] for row in found["models"] if row["run"] is not None] == ["small", "small"]
    assert found["data"] == "made, test side, at v1"


def test_a_network_of_the_branch_that_is_judged_is_found_at_its_head(
    lake: Path, tmp_path: Path
) -> None:
    copy = tmp_path / "lake"
    shutil.copytree(lake, copy)
    opened = Lake.open(copy)
    opened.branch("other", at="v1")
    opened.withdraw(opened.rows("kind = 'network'")["artifact"].to_pylist(), "of another test")
    recipe = str(lake.parent / "small.toml")
    arguments = ["--at", "v1", "--lake", str(copy), "--workers", "1", "--seed", "9"]
    trained = run("train", recipe, *arguments, "--branch", "other")
    where = ["--dataset", "made", "--lake", str(copy)]
    with pytest.raises(UnknownNameError, match="small"):
        run("evaluate", "small", "--at", "v1", *where, "--out", str(tmp_path / "main"))
    found = run(
        "evaluate",
        trained["artifact"][:8],
        "--at",
        "other",
        *where,
        "--out",
        str(tmp_path / "other"),
    )
    assert [row["label"] for row in found["models"]] == ["small"]


def test_a_clip_is_cut_to_what_a_network_takes_and_a_short_one_goes_on_in_its_film(
    lake: Path,
) -> None:
    recipe = load(str(lake.parent / "small.toml"))
    pairs = sides_of(flagdata.open(lake), recipe, "test", at="v1")
    stored, film = pairs[3].clip[0].numpy(), pairs.film(3)
    assert np.array_equal(clip_as_taken(pairs, 3, recipe.front_end), stored)
    assert np.array_equal(clip_as_taken(pairs, 3, replace(recipe.front_end, frames=8)), stored[:8])
    assert np.array_equal(clip_as_taken(pairs, 3, replace(recipe.front_end, frames=14)), film)
    with pytest.raises(InputError, match="film of 14 frames at 25 Hz cannot give clips of 15"):
        clip_as_taken(pairs, 3, replace(recipe.front_end, frames=15))


def test_a_clip_of_another_rate_is_shown_at_the_networks_instants(lake: Path) -> None:
    """At half the film's rate its instants are those of every second frame."""
    recipe = load(str(lake.parent / "small.toml"))
    pairs = sides_of(flagdata.open(lake), recipe, "test", at="v1")
    slow = replace(recipe.front_end, frames=6, rate=12.5)
    assert np.array_equal(clip_as_taken(pairs, 3, slow), pairs.film(3)[:12:2])
    films = StatedFilms.of(flagdata.open(lake).lake, pairs, at="v1")
    films.check_judged(slow, recipe.cropping, model="slow")
    with pytest.raises(InputError, match="12 of 12 films cannot give clips of 12 frames at 32 Hz"):
        films.check_judged(replace(slow, frames=12, rate=32.0), recipe.cropping, model="fast")


def test_yardsticks_score_triplets_of_other_lengths_and_read_the_cloth_from_embeddings(
    lake: Path, tmp_path: Path
) -> None:
    of_lake = ("small", "--dataset", "made", "--lake", str(lake), "--out", str(tmp_path), "--json")
    beside = ("--at", "main", "--frames", "8", "--frames", "12", "--linear")
    command = yardsticks.command
    done = CliRunner().invoke(command, [*of_lake, *beside], catch_exceptions=False)
    found = json.loads(done.stdout)
    assert [(point["label"], point["frames"]) for point in found["frames"]] == [
        ("small", 8),
        ("small", 12),
    ]
    assert all(0 <= point["accuracy"] <= 1 for point in found["frames"])
    assert found["frames"][0]["accuracy"] != found["frames"][1]["accuracy"]
    assert set(found["linear"][0]["pearson"]) == {"log area_weight", "log stiffness"}
    text = (tmp_path / "evaluation.md").read_text()
    assert "## Triplet accuracy against frames" in text
    assert "## Linear readout of the embedding" in text


def test_yardsticks_of_clips_longer_than_the_films_are_refused(lake: Path, tmp_path: Path) -> None:
    longer = ("small", "--dataset", "made", "--lake", str(lake), "--out", str(tmp_path))
    done = CliRunner().invoke(yardsticks.command, [*longer, "--frames", "90"])
    assert isinstance(done.exception, InputError)
    assert "film has 14 frames" in str(done.exception)


def test_a_shipped_ensemble_estimates_clips_and_knows_what_is_unlike_them(
    lake: Path, tmp_path: Path
) -> None:
    recipe = load(str(lake.parent / "small.toml"))
    source = flagdata.open(lake)
    train, validation, test = (
        sides_of(source, recipe, side, at="v1") for side in ("train", "validation", "test")
    )
    cache = tmp_path / "cache"
    known = prepare_films(
        train,
        recipe.front_end,
        recipe.cropping,
        variants=2,
        folder=cache,
        workers=1,
        advance=lambda count: None,
    )
    judged = prepare_clips(
        validation,
        recipe.front_end,
        recipe.cropping,
        folder=cache,
        workers=1,
        advance=lambda count: None,
    )
    rows = source.lake.rows("kind = 'network'", columns=["object"]).to_pylist()
    members = [source.lake.object_path(row["object"]) for row in rows]
    shipped = shipping.write(
        tmp_path / "small", members, train=known, validation=judged, name="small"
    )
    assert len(shipped.learners) == 2
    clips = np.stack([test[index].clip[0].numpy() for index in range(4)])
    found = shipped.estimate(shipped.inputs(clips), seed=1, draws=200)
    again = shipped.estimate(shipped.inputs(clips), seed=1, draws=200)
    assert found.draws.shape == (4, 200, 1)
    assert np.array_equal(found.draws, again.draws)
    low, high = found.interval(0.9)
    assert ((low <= found.mean) & (found.mean <= high)).all()
    assert found.unlike is not None
    still = np.full_like(clips, 100)
    odd = shipped.estimate(shipped.inputs(still), seed=1).unlike
    assert odd is not None
    assert odd.max() <= found.unlike.max()
    with pytest.raises(InputError, match="12"):
        shipped.inputs(clips[:, :11])


def test_clips_beyond_the_range_of_their_target_are_refused_before_anything_is_prepared(
    lake: Path, tmp_path: Path
) -> None:
    """The range of "cloth_wind" ends at 6 m/s, the winds of the lake at 10."""
    path = tmp_path / "small-cloth.toml"
    path.write_text(TRAINING.replace('["wind_speed"]', '["cloth_wind"]'))
    strong = [seed for seed in range(10) if np.random.default_rng(seed).uniform(0, 10) > 6.03]
    arguments = [
        "train",
        str(path),
        "--at",
        "v1",
        "--lake",
        str(lake),
        "--cache",
        str(tmp_path / "cache"),
    ]
    done = CliRunner().invoke(root, arguments)
    assert isinstance(done.exception, InputError)
    assert done.exception.where == "the training side"
    assert (
        f"{2 * len(strong)} of 20 clips lie beyond the range of the target cloth_wind, 0 to 6 m/s"
        in str(done.exception)
    )
    assert not (tmp_path / "cache").exists()


def test_a_model_of_hanging_cloth_estimates_the_same_quantities_in_its_own_ranges(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Trained on a part of the sequences, shipped and judged by the commands that are there for
    flags."""
    from tests.models.conftest import fill

    lake = tmp_path / "lake"
    fill(Lake.create(lake), strongest=6.0)
    Lake.open(lake).tag("v1")
    path = tmp_path / "small-cloth.toml"
    part = TRAINING.replace("[data]\n", "[data]\nsequences = 8\n")
    path.write_text(part.replace('["wind_speed"]', '["cloth_wind", "cloth_area_weight"]'))
    trained = run(
        "train", str(path), "--at", "v1", "--lake", str(lake), "--workers", "1", "--branch", "main"
    )
    options = ["--lake", str(lake), "--at", "v1", "--out", str(tmp_path / "shipped")]
    done = CliRunner().invoke(shipping.main, [str(path), *options], catch_exceptions=False)
    assert done.exit_code == 0, done.output
    monkeypatch.setattr(estimator, "SHIPPED", tmp_path / "shipped")
    model = estimator.load_shipped("small-cloth")
    assert trained["name"] == model.name == "small-cloth"
    assert model.cloth is Cloth.HANGING
    assert model.card["trained"]["sequences"] == 8
    assert [(target.name, target.high) for target in model.targets] == [
        ("wind_speed", 6.0),
        ("area_weight", 0.454),
    ]
    found = run(
        "evaluate",
        "shipped/small-cloth",
        "--dataset",
        "made",
        "--lake",
        str(lake),
        "--out",
        str(tmp_path / "page"),
    )
    assert {row["target"] for row in found["targets"]} == {"wind_speed", "area_weight"}


def test_a_model_that_was_cut_off_is_an_error_with_its_place(lake: Path, tmp_path: Path) -> None:
    row = Lake.open(lake).rows("kind = 'network'").to_pylist()[0]
    folder = tmp_path / "model"
    shutil.copytree(Lake.open(lake).object_path(row["object"]), folder)
    path = folder / WEIGHTS
    path.chmod(0o644)
    path.write_bytes(path.read_bytes()[:-10])
    with pytest.raises(CorruptError):
        estimator.load(folder)
    with pytest.raises(NotFoundError):
        estimator.load(tmp_path)


def test_inputs_that_were_prepared_are_used_again_and_damage_is_found(
    lake: Path, tmp_path: Path
) -> None:
    recipe = load(str(lake.parent / "small.toml"))
    pairs = sides_of(flagdata.open(lake), recipe, "train", at="v1")

    def prepared() -> tuple[object, list[int]]:
        counts: list[int] = []
        found = prepare_films(
            pairs,
            recipe.front_end,
            recipe.cropping,
            variants=2,
            folder=tmp_path,
            workers=2,
            advance=counts.append,
        )
        return found, counts

    first, _ = prepared()
    second, counts = prepared()
    entries, variants = np.arange(4), np.ones(4, dtype=np.int64)
    assert torch.equal(first.batch(entries, variants), second.batch(entries, variants))  # pyright: ignore[reportAttributeAccessIssue]
    assert counts == [20]
    gone = next(tmp_path.rglob("*.npy"))
    gone.write_bytes(gone.read_bytes()[:50])
    with pytest.raises(CorruptError, match="prepared input"):
        second.batch(np.arange(20), np.zeros(20, dtype=np.int64))  # pyright: ignore[reportAttributeAccessIssue]


def test_one_bit_in_a_prepared_input_is_found_and_the_input_made_anew(
    lake: Path, tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    recipe = load(str(lake.parent / "small.toml"))
    pairs = sides_of(flagdata.open(lake), recipe, "validation", at="v1")

    def prepared() -> dict[Path, bytes]:
        prepare_clips(
            pairs,
            recipe.front_end,
            recipe.cropping,
            folder=tmp_path,
            workers=2,
            advance=lambda count: None,
        )
        return {path: path.read_bytes() for path in tmp_path.rglob("*.npy")}

    whole = prepared()
    assert not caplog.messages
    first, second = list(whole)[:2]
    changed = bytearray(whole[first])
    changed[len(changed) // 2] ^= 1
    first.write_bytes(changed)
    second.write_bytes(whole[second][:-32])  # as older versions wrote it
    assert prepared() == whole
    (warning,) = caplog.messages
    assert "2 prepared inputs are damaged" in warning


def test_a_process_that_prepares_waits_for_another_and_then_makes_nothing_twice(
    lake: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    recipe = load(str(lake.parent / "small.toml"))
    pairs = sides_of(flagdata.open(lake), recipe, "validation", at="v1")

    def prepared() -> list[int]:
        counts: list[int] = []
        prepare_clips(
            pairs,
            recipe.front_end,
            recipe.cropping,
            folder=tmp_path,
            workers=1,
            advance=counts.append,
        )
        return counts

    written: list[Path] = []
    write = inputs._write
    monkeypatch.setattr(
        inputs, "_write", lambda path, *rest: (written.append(path), write(path, *rest))
    )
    (own,) = {path.parent.parent for path in tmp_path.rglob("*.npy")} if prepared() else ()
    made = list(written)
    for path in made:
        path.rename(path.with_suffix(".kept"))

    def other_process_ends() -> None:
        for path in made:
            path.with_suffix(".kept").rename(path)

    with ThreadPoolExecutor(1) as pool, alone_in(own, occupied=pytest.fail):
        waiting = pool.submit(prepared)
        while not caplog.messages:
            time.sleep(0.01)
        other_process_ends()
    assert waiting.result() == [0, len(made)]
    assert written == made
    assert "another process prepares inputs" in caplog.messages[0]


def test_a_second_training_in_a_run_folder_is_refused_before_it_does_anything(
    lake: Path, tmp_path: Path
) -> None:
    run_folder, cache = tmp_path / "run", tmp_path / "cache"
    arguments = [
        "train",
        str(lake.parent / "small.toml"),
        "--seed",
        "7",
        "--lake",
        str(lake),
        "--at",
        "v1",
    ]
    with alone_in(run_folder, occupied=pytest.fail):
        done = CliRunner().invoke(
            root, [*arguments, "--run", str(run_folder), "--cache", str(cache)]
        )
    assert isinstance(done.exception, ConflictError)
    assert done.exception.where == str(run_folder)
    assert "--run" in done.exception.fix
    assert not cache.exists()


def test_a_part_of_the_sequences_is_the_beginning_of_one_order(lake: Path, tmp_path: Path) -> None:
    recipe = load(str(lake.parent / "small.toml"))
    pairs = sides_of(flagdata.open(lake), recipe, "train", at="v1")

    def sequences(count: int | None) -> set[int]:
        found = prepare_films(
            pairs,
            recipe.front_end,
            recipe.cropping,
            variants=2,
            folder=tmp_path,
            workers=1,
            advance=lambda done: None,
            sequences=count,
        )
        return set(found.sequence.tolist())

    assert len(sequences(3)) == 3
    assert sequences(3) < sequences(6) < sequences(None)
    with pytest.raises(InputError, match="10"):
        sequences(11)


@pytest.mark.parametrize(
    ("old", "new", "told", "fix"),
    [
        (
            "frames = 12",
            "frames = 20",
            "clips of 20 frames at 25 Hz; the first has 14 frames",
            "write frames = 14 in [input]",
        ),
        (
            "frames = 12",
            "frames = 12\nrate = 30.0",
            "another rate than the recipe's 30 Hz",
            "write rate = 25 in [input]",
        ),
        (
            "size = 24",
            "size = 56",
            "pictures of 56 px, and the films have 40 px",
            "write size = 40 in [input]",
        ),
        (
            "batch = 4",
            "batch = 24",
            "20 films do not make a batch of 24",
            "write batch = 20 in [optimiser]",
        ),
        ('"wind_speed"', '"log_aspect"', "no clip states its width", "leave the target out"),
    ],
)
def test_a_recipe_that_does_not_fit_the_clips_is_refused_before_anything_is_prepared(
    lake: Path, tmp_path: Path, old: str, new: str, told: str, fix: str
) -> None:
    assert old in TRAINING
    (tmp_path / "small.toml").write_text(TRAINING.replace(old, new))
    recipe, cache = str(tmp_path / "small.toml"), tmp_path / "cache"
    done = CliRunner().invoke(
        root, ["train", recipe, "--at", "v1", "--lake", str(lake), "--cache", str(cache)]
    )
    assert isinstance(done.exception, FlagdataError)
    assert told in done.exception.what
    assert fix in done.exception.fix
    assert not cache.exists()


def test_clips_that_the_network_does_not_take_are_refused_before_they_are_prepared(
    lake: Path, tmp_path: Path
) -> None:
    small = TRAINING.replace('maps = "wave-maps"', 'maps = "frames"').replace(
        'name = "wave"', 'name = "cardona"'
    )
    recipe = tmp_path / "small.toml"
    recipe.write_text(small.replace("dimension = 4\nwidths = [6, 6, 6]\n", ""))
    arguments = [
        "train",
        str(recipe),
        "--at",
        "v1",
        "--lake",
        str(lake),
        "--cache",
        str(tmp_path / "cache"),
    ]
    done = CliRunner().invoke(root, arguments)
    assert done.exit_code != 0
    assert "at least 64×64" in str(done.output) + str(done.exception)
    assert not (tmp_path / "cache").exists()


@pytest.mark.parametrize("name", TRAININGS.names())
def test_every_recipe_of_the_catalog_is_read_and_makes_its_network(name: str) -> None:
    recipe = load(name)
    recipe.check()
    with torch.device("meta"):
        assert sum(weights.numel() for weights in recipe.learner().network.parameters()) > 100_000
    assert recipe.front_end.frames == 30


@pytest.mark.parametrize(
    ("old", "new", "error", "named"),
    [
        ("dimension = 4", "dimensions = 4", InputError, "does not take"),
        ('maps = "wave-maps"', 'maps = "spectral-maps"', UsageError, 'maps = "wave-maps"'),
        ('"wind_speed"', '"wind_sped"', UnknownNameError, "wind_speed"),
        ('name = "wave"', 'name = "wav"', UnknownNameError, "wave"),
        ("components = 2", "margin = 1.0", UsageError, "margin"),
        ("patience = 9", "drop-after = 9", UsageError, "drop-after"),
        ("variants = 2", "variant = 2", UnknownNameError, "variants"),
        ('dataset = "made"', 'dataset = " "', InputError, "data set"),
    ],
)
def test_a_recipe_that_does_not_fit_says_what_and_how(
    old: str, new: str, error: type[Exception], named: str
) -> None:
    with pytest.raises(error) as caught:
        parse(TRAINING.replace(old, new), name="small", where="test").learner()
    assert named in f"{caught.value} {getattr(caught.value, 'fix', '')}"


def test_a_network_that_is_not_there_is_an_error_with_those_that_are(
    lake: Path, tmp_path: Path
) -> None:
    with pytest.raises(UnknownNameError, match="smal"):
        CliRunner().invoke(
            root,
            ["evaluate", "smal", "--dataset", "made", "--lake", str(lake), "--out", str(tmp_path)],
            catch_exceptions=False,
        )


def test_a_data_set_that_is_not_there_is_an_error(lake: Path) -> None:
    recipe = parse(
        (lake.parent / "small.toml").read_text().replace('"made"', '"nothing"'),
        name="x",
        where="test",
    )
    with pytest.raises(UnknownNameError, match="unknown data set 'nothing'; known: made"):
        sides_of(flagdata.open(lake), recipe, "train", at="v1")


def test_each_of_several_processes_takes_a_gpu_of_its_own(monkeypatch: pytest.MonkeyPatch) -> None:
    taken: list[str] = []
    monkeypatch.setattr(torch.cuda, "set_device", taken.append)
    monkeypatch.setenv("LOCAL_RANK", "3")
    assert train_command.device_of_rank("cpu") == "cpu"
    assert train_command.device_of_rank("cuda") == "cuda:3"
    assert taken == ["cuda:3"]
    with pytest.raises(UsageError, match="all processes of torchrun would compute on 'cuda:1'"):
        train_command.device_of_rank("cuda:1")
