"""Steps that can be taken up again: the same weights whether a training ran through or was stopped;
ranks; errors."""

from __future__ import annotations

import json
import shutil
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest
import torch

from flagdata.errors import (
    ConflictError,
    CorruptError,
    FlagdataError,
    InputError,
    RefusedError,
    UsageError,
)
from models.evaluation.predict import predict
from models.maps.crops import Cropping
from models.maps.frontend import FrontEnd
from models.networks.learner import Learner, Loss, contrastive_loss
from models.trained.estimator import Estimator
from models.training import Augment, DataSpec, Prepared, TrainingRecipe, checkpoint
from models.training.steps import (
    Batches,
    Trained,
    Training,
    TrainingDivergedError,
    learning_rate,
    validation_batches,
)
from models.training.training_recipe import (
    LossSpec,
    NetworkSpec,
    OptimiserSpec,
    Precision,
    Schedule,
)

SIZE = 24
FRONT_END = FrontEnd(maps="wave-maps", size=SIZE)


def prepared(count: int, *, seed: int) -> Prepared:
    """Maps in which the wind is the mean of the first channel, two entries of each simulation."""
    rng = np.random.default_rng(seed)
    wind = np.repeat(rng.uniform(0, 10, count // 2), 2)
    maps = rng.normal(size=(count, 2, *FRONT_END.shape)) * 0.1
    maps[:, :, 0] += wind[:, None, None, None] / 10
    parameters = {"wind_speed": wind, "area_weight": rng.uniform(0.1, 0.17, count)}
    return Prepared(
        maps=maps.astype(np.float16),
        parameters=parameters,
        sequence=np.repeat(np.arange(count // 2), 2),
        fingerprint=f"made-{seed}",
        front_end=FRONT_END,
    )


def recipe(loss: Loss = Loss.POSTERIOR, **optimiser: object) -> TrainingRecipe:
    spec = OptimiserSpec(
        rate=5e-3, decay=1e-4, batch=8, epochs=4, schedule=Schedule.COSINE, patience=9
    )
    targets = () if loss is Loss.CONTRASTIVE else ("wind_speed",)
    return TrainingRecipe(
        name="small",
        title="",
        seed=3,
        data=DataSpec(datasets=("made",)),
        front_end=FRONT_END,
        cropping=Cropping(size=SIZE),
        variants=2,
        augment=Augment(),
        network=NetworkSpec(name="wave", options={"dimension": 4, "widths": (4, 4, 4)}),
        loss=LossSpec(name=loss, targets=targets, components=2),
        optimiser=replace(spec, **optimiser),  # pyright: ignore[reportArgumentType]
    )


@contextmanager
def silent(total: int, label: str, unit: str) -> Iterator[Callable[[int], None]]:
    yield lambda count: None


def stopped_after(clips: int) -> Callable[..., object]:
    """Bars that end the process's work, as Ctrl-C would, once so many clips were trained on."""
    done = 0

    @contextmanager
    def bars(total: int, label: str, unit: str) -> Iterator[Callable[[int], None]]:
        def advance(count: int) -> None:
            nonlocal done
            done += count
            if done > clips:
                raise KeyboardInterrupt

        yield advance

    return bars


def training(run: Path, own: TrainingRecipe, **changes: object) -> Training:
    given = Training(
        recipe=own,
        train=prepared(40, seed=1),
        validation=prepared(16, seed=2),
        run=run,
        identity={"recipe": own.identity()},
        device=torch.device("cpu"),
        bars=silent,
        checkpoint_seconds=0.0,
    )
    return replace(given, **changes)  # pyright: ignore[reportArgumentType]


@pytest.fixture(
    scope="module", autouse=True
)  # weights are compared between tests, and depend on the threads
def one_thread() -> Iterator[None]:
    before = torch.get_num_threads()
    torch.set_num_threads(1)
    yield
    torch.set_num_threads(before)


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory, one_thread: None) -> Callable[[Loss], Trained]:
    """Trainings that ran through, one a loss."""
    return cache(
        lambda loss: training(tmp_path_factory.mktemp("whole") / "run", recipe(loss)).complete()
    )


@pytest.mark.parametrize("loss", list(Loss))
@pytest.mark.parametrize("clips", [20, 41, 90])
def test_a_training_that_was_stopped_reaches_the_weights_of_one_that_was_not(
    tmp_path: Path, loss: Loss, clips: int, whole: Callable[[Loss], Trained]
) -> None:
    with pytest.raises(KeyboardInterrupt):
        training(tmp_path / "broken", recipe(loss), bars=stopped_after(clips)).complete()
    checkpoint.check_folder(tmp_path / "broken")
    taken_up, unbroken = training(tmp_path / "broken", recipe(loss)).complete(), whole(loss)
    for name, value in unbroken.learner.state_dict().items():
        assert torch.equal(value, taken_up.learner.state_dict()[name]), name
    known = [(epoch.train, epoch.validation) for epoch in unbroken.course.epochs]
    assert known == [(epoch.train, epoch.validation) for epoch in taken_up.course.epochs]


def test_other_seeds_give_other_weights_and_the_same_seed_the_same(
    tmp_path: Path, whole: Callable[[Loss], Trained]
) -> None:
    first = whole(Loss.POSTERIOR).learner.state_dict()
    second, other = (
        training(tmp_path / str(seed), replace(recipe(), seed=seed)).complete().learner.state_dict()
        for seed in (3, 4)
    )
    assert all(torch.equal(first[name], second[name]) for name in first)
    assert not torch.equal(first["network.summary.0.weight"], other["network.summary.0.weight"])


def test_what_is_in_the_maps_is_learned(tmp_path: Path) -> None:
    own = recipe(Loss.REGRESSION, epochs=20, rate=1e-2)
    done = training(tmp_path, own, train=prepared(240, seed=1), checkpoint_seconds=1e9).complete()
    assert done.course.best is not None
    assert done.course.best.validation < 0.2  # of 1, what the mean of the training set has


def test_a_plateau_ends_the_training_and_the_best_weights_are_given(tmp_path: Path) -> None:
    done = training(tmp_path, recipe(epochs=40, rate=0.3, patience=3)).complete()
    best = done.course.best
    assert best is not None
    assert len(done.course.epochs) == best.number + 4


def test_a_loss_that_is_no_number_is_an_error_and_the_last_checkpoint_stays(tmp_path: Path) -> None:
    with pytest.raises(KeyboardInterrupt):
        training(tmp_path, recipe(), bars=stopped_after(30)).complete()
    before = (tmp_path / "last" / "card.json").read_bytes()
    bad = prepared(40, seed=1)
    bad.maps[:] = np.nan
    with pytest.raises(TrainingDivergedError, match="epoch 1"):
        training(tmp_path, recipe(), train=bad).complete()
    assert (tmp_path / "last" / "card.json").read_bytes() == before


def test_a_full_disk_leaves_the_last_checkpoint(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with pytest.raises(KeyboardInterrupt):
        training(tmp_path, recipe(), bars=stopped_after(30)).complete()
    before = (tmp_path / "last" / "card.json").read_bytes()

    def full(path: Path, tensors: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(checkpoint, "write_tensors", full)
    with pytest.raises(FlagdataError, match="No space left"):
        training(tmp_path, recipe()).complete()
    assert (tmp_path / "last" / "card.json").read_bytes() == before


def test_a_checkpoint_of_another_recipe_is_refused(tmp_path: Path) -> None:
    training(tmp_path, recipe(epochs=1)).complete()
    with pytest.raises(RefusedError, match="another training"):
        training(tmp_path, recipe(epochs=2)).complete()


def test_a_checkpoint_of_other_data_is_refused(tmp_path: Path) -> None:
    training(tmp_path, recipe(epochs=2), bars=silent).complete()
    with pytest.raises(RefusedError, match="fingerprint"):
        training(tmp_path, recipe(epochs=2), train=prepared(40, seed=9)).complete()


@pytest.fixture(scope="module")
def stopped(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The run folder of a training that was stopped in its third epoch."""
    folder = tmp_path_factory.mktemp("stopped") / "broken"
    with pytest.raises(KeyboardInterrupt):
        training(folder, recipe(), bars=stopped_after(90)).complete()
    return folder


@pytest.mark.parametrize(
    ("name", "damage"),
    [
        ("card.json", "changed"),
        ("weights.safetensors", "changed"),
        ("moments.safetensors", "cut"),
        ("best.safetensors", "changed"),
        ("SHA256SUMS", "cut"),
    ],
)
def test_a_damaged_checkpoint_is_passed_over_for_the_one_before_and_the_weights_stay_the_same(
    stopped: Path,
    whole: Callable[[Loss], Trained],
    tmp_path: Path,
    caplog: pytest.LogCaptureFixture,
    name: str,
    damage: str,
) -> None:
    run = Path(shutil.copytree(stopped, tmp_path / "run"))
    spoil(run / "last" / name, damage)
    taken_up, unbroken = (
        done.learner.state_dict()
        for done in (training(run, recipe()).complete(), whole(Loss.POSTERIOR))
    )
    assert all(torch.equal(value, taken_up[key]) for key, value in unbroken.items())
    (warning,) = caplog.messages
    assert "the last checkpoint is damaged" in warning
    assert "goes on from the one before it" in warning
    assert str(run / "last" / name) in warning


def spoil(path: Path, damage: str) -> None:
    content = bytearray(path.read_bytes())
    if damage == "changed":
        content[-40:-36] = b"XXXX"
    path.write_bytes(content if damage == "changed" else content[:-40])


def test_checkpoints_that_are_all_damaged_are_an_error_with_the_file_and_the_fix(
    tmp_path: Path,
) -> None:
    training(tmp_path, recipe(epochs=1)).complete()
    for kept in ("last", "before"):
        spoil(tmp_path / kept / "weights.safetensors", "changed")
    with pytest.raises(CorruptError, match="have changed since it was written") as caught:
        training(tmp_path, recipe(epochs=1)).complete()
    assert caught.value.where == str(tmp_path / "last" / "weights.safetensors")
    assert "delete all checkpoints" in caught.value.fix


def test_a_kill_between_the_two_renames_loses_nothing(
    tmp_path: Path, whole: Callable[[Loss], Trained]
) -> None:
    with pytest.raises(KeyboardInterrupt):
        training(tmp_path / "broken", recipe(), bars=stopped_after(50)).complete()
    shutil.rmtree(tmp_path / "broken" / "before")
    (tmp_path / "broken" / "last").rename(tmp_path / "broken" / "before")
    taken_up = training(tmp_path / "broken", recipe()).complete()
    assert all(
        torch.equal(v, taken_up.learner.state_dict()[n])
        for n, v in whole(Loss.POSTERIOR).learner.state_dict().items()
    )


def test_a_target_that_clips_do_not_state_is_an_error(tmp_path: Path) -> None:
    unknown = prepared(40, seed=1)
    unknown.parameters["wind_speed"][7] = np.nan
    with pytest.raises(InputError, match="entry 7 does not state its wind_speed"):
        training(tmp_path, recipe(), train=unknown).complete()


@pytest.mark.parametrize("side", ["train", "validation"])
def test_a_wind_beyond_the_range_is_refused_and_not_learned_as_its_end(
    tmp_path: Path, side: str
) -> None:
    strong = prepared(40, seed=1)
    strong.parameters["wind_speed"][7] = 14.0
    with pytest.raises(
        InputError, match="1 of 40 clips lie beyond the range of the target wind_speed, 0 to 10 m/s"
    ):
        training(tmp_path, recipe(), **{side: strong}).complete()
    assert not (tmp_path / "last").exists()


def test_an_evaluation_says_how_many_truths_the_network_cannot_state() -> None:
    strong = prepared(40, seed=1)
    strong.parameters["wind_speed"][7:10] = 14.0
    own = recipe()
    judged = Estimator(
        name="small",
        learners=(own.learner().eval(),),
        front_end=own.front_end,
        cropping=own.cropping,
        widening=torch.ones(1),
        cloud=None,
        card={},
    )
    found = predict(judged, strong, label="small", note="seed 3", milliseconds=1.0, seed=1)
    assert found.note.startswith(
        "seed 3; 3 of 40 clips lie beyond the range of the target wind_speed, 0 to 10 m/s"
    )
    strong.parameters["wind_speed"][7:10] = 10.0
    assert (
        predict(judged, strong, label="small", note="seed 3", milliseconds=1.0, seed=1).note
        == "seed 3"
    )


def test_rates_fall_by_a_tenth_after_the_epochs_that_were_named() -> None:
    spec = OptimiserSpec(rate=1e-2, epochs=40, drop_after=20)
    assert [learning_rate(spec, step * 10, 10) for step in (0, 19, 20, 39)] == pytest.approx(
        [1e-2, 1e-2, 1e-3, 1e-3]
    )


def test_the_cosine_rises_and_falls() -> None:
    spec = OptimiserSpec(rate=1.0, epochs=10, schedule=Schedule.COSINE)
    rates = [learning_rate(spec, step, 10) for step in range(100)]
    top = int(np.argmax(rates))
    assert rates[top] == 1.0
    assert rates[:top] == sorted(rates[:top])
    assert rates[top:] == sorted(rates[top:], reverse=True)
    assert rates[-1] < 0.01


def test_bfloat16_trains_to_nearly_the_same_loss(tmp_path: Path) -> None:
    plain, rounded = (
        training(tmp_path / kind.value, recipe(Loss.REGRESSION, precision=kind))
        .complete()
        .course.epochs[-1]
        .train
        for kind in (Precision.FLOAT32, Precision.BFLOAT16)
    )
    assert rounded == pytest.approx(plain, rel=0.1)


class TestBatches:
    def test_each_entry_is_in_an_epoch_once_and_the_next_epoch_takes_the_next_variant(self) -> None:
        batches = Batches(prepared=prepared(40, seed=1), size=8, seed=5)
        first = {int(e): b.inputs[k] for b in batches for k, e in enumerate(b.entries)}
        second = {int(e): b.inputs[k] for b in batches for k, e in enumerate(b.entries)}
        assert sorted(first) == sorted(second) == list(range(40))
        assert list(first) != list(second)
        assert not any(torch.equal(first[entry], second[entry]) for entry in first)

    def test_films_of_one_simulation_follow_one_another_where_a_loss_needs_pairs(self) -> None:
        batches = Batches(prepared=prepared(40, seed=1), size=8, seed=5, together=True)
        for batch in batches:
            assert batch.sequence.unique(return_counts=True)[1].tolist() == [2] * 4

    def test_ranks_take_apart_what_one_process_takes(self) -> None:
        data = prepared(40, seed=1)
        whole = [batch.entries.tolist() for batch in Batches(prepared=data, size=8, seed=5)]
        parts = [
            [
                batch.entries.tolist()
                for batch in Batches(prepared=data, size=8, seed=5, share=(rank, 2))
            ]
            for rank in (0, 1)
        ]
        assert whole == [one + other for one, other in zip(*parts, strict=True)]

    def test_the_hash_of_the_order_is_that_of_all_ranks_and_differs_with_epoch_seed_and_data(
        self,
    ) -> None:
        data, other = prepared(40, seed=1), prepared(40, seed=2)
        batches = Batches(prepared=data, size=8, seed=5)
        before = batches.order_hash(1)
        assert list(batches)  # an epoch on
        assert before == batches.order_hash(1)
        assert before == Batches(prepared=data, size=8, seed=5, share=(1, 2)).order_hash(1)
        different = [
            before,
            batches.order_hash(0),
            Batches(prepared=data, size=8, seed=6).order_hash(1),
            Batches(prepared=other, size=8, seed=5).order_hash(1),
        ]
        assert len(set(different)) == 4

    def test_sizes_that_ranks_cannot_share_are_refused(self) -> None:
        with pytest.raises(UsageError, match="multiple"):
            Batches(prepared=prepared(40, seed=1), size=9, seed=5, share=(0, 2))

    def test_fewer_films_than_a_batch_are_refused(self) -> None:
        with pytest.raises(UsageError, match="do not make a batch"):
            Batches(prepared=prepared(4, seed=1), size=8, seed=5)


_RANK = """
import json, sys
from pathlib import Path
import torch
from torch import distributed as ranks
sys.path.insert(0, {here!r})
from test_steps import Loss, Learner, recipe, training, small_learner
from models.training.training_recipe import TrainingRecipe
torch.set_num_threads(1)
rank, folder = int(sys.argv[1]), Path(sys.argv[2])
ranks.init_process_group("gloo", init_method=f"file://{{folder}}/meet", rank=rank, world_size=2)
TrainingRecipe.learner = small_learner
done = training(folder / "run-2", recipe(Loss.REGRESSION, epochs=2), checkpoint_seconds=1e9).complete()
ranks.barrier()  # as `models.training.train_command` has it: no rank leaves while another still talks to it
if rank == 0:
    state = {{name: value.double().tolist() for name, value in done.learner.state_dict().items()}}
    (folder / "weights.json").write_text(json.dumps(state))
ranks.destroy_process_group()
"""


def small_learner(own: TrainingRecipe) -> Learner:
    """A network without batch statistics, which each rank has of its own part."""

    class Mean(torch.nn.Module):
        dimension = 6

        def __init__(self) -> None:
            super().__init__()
            self.layer = torch.nn.Linear(FRONT_END.shape[0], 6)

        def forward(self, maps: torch.Tensor) -> torch.Tensor:
            return self.layer(maps.mean(dim=(2, 3))).tanh()

    return Learner(Mean(), loss=own.loss.name, targets=own.loss.targets)


@pytest.mark.parametrize("sequences", [2, 3, 20, 200])
@pytest.mark.parametrize("clips", [2, 24, 38, 76])
def test_a_contrastive_loss_is_validated_on_batches_of_whole_sequences_that_it_can_compare(
    sequences: int, clips: int
) -> None:
    sequence = np.random.default_rng(0).permutation(np.repeat(np.arange(sequences) * 7, clips))
    batches = validation_batches(sequence, whole=True)
    assert sorted(np.concatenate(batches).tolist()) == list(range(len(sequence)))
    own = [set(sequence[entries].tolist()) for entries in batches]
    assert sum(map(len, own)) == sequences  # none is in two
    for entries in batches:
        loss = contrastive_loss(torch.zeros(len(entries), 2), torch.from_numpy(sequence[entries]))
        assert torch.isfinite(loss)
    assert max(map(len, batches)) <= 64 + 3 * clips


def test_other_losses_are_validated_on_every_clip() -> None:
    assert [
        len(entries) for entries in validation_batches(np.zeros(129, np.int64), whole=False)
    ] == [64, 64, 1]


def test_two_ranks_take_the_steps_of_one(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Gradients of two halves, averaged by gloo, are those of the whole batch."""
    script = tmp_path / "rank.py"
    script.write_text(_RANK.format(here=str(Path(__file__).parent)))
    root = str(Path(__file__).resolve().parents[3])

    def started(rank: int) -> subprocess.Popen[bytes]:
        command = [sys.executable, str(script), str(rank), str(tmp_path)]
        return subprocess.Popen(
            command, cwd=root, env={"PYTHONPATH": root, "PATH": "/usr/bin:/bin"}
        )

    with monkeypatch.context() as patch:
        patch.setattr(TrainingRecipe, "learner", small_learner)
        own = recipe(Loss.REGRESSION, epochs=2)
        alone = (
            training(tmp_path / "run-1", own, checkpoint_seconds=1e9)
            .complete()
            .learner.state_dict()
        )
    assert [process.wait(timeout=500) for process in [started(rank) for rank in range(2)]] == [0, 0]
    shared = json.loads((tmp_path / "weights.json").read_text())
    for name, values in alone.items():
        np.testing.assert_allclose(shared[name], values.numpy(), rtol=1e-5, atol=1e-6, err_msg=name)


@pytest.mark.parametrize(
    "theirs", ["notes.txt", "next/thesis.tex", "before/last/a", "last/card.json/b"]
)
def test_a_run_folder_with_anything_else_in_it_is_refused(theirs: str, tmp_path: Path) -> None:
    """Checkpoints replace the folders next, last and before: none of them may be a user's."""
    checkpoint.check_folder(tmp_path / "new")
    path = tmp_path / "run" / theirs
    path.parent.mkdir(parents=True)
    path.write_text("mine")
    with pytest.raises(ConflictError, match="no training wrote"):
        checkpoint.check_folder(tmp_path / "run")


def test_the_length_of_a_training_is_in_proportion_to_its_epochs_and_trying_it_changes_no_draw(
    tmp_path: Path,
) -> None:
    few, many = (training(tmp_path / str(n), recipe(epochs=n)) for n in (2, 2000))
    before = torch.random.get_rng_state()
    short, long = few.length(2), many.length(2000)
    assert torch.equal(torch.random.get_rng_state(), before)
    assert 0 < short < long / 20  # a thousand times, however unevenly a busy machine runs
    assert few.batches.epoch == 0
