"""The side that a data set states is its side, on every way from a lake to a tensor or to an
exported file.

Each film of a small lake shows its side: by the gray of its pictures and by its wind. Every way is
walked for every side, and what comes out is looked at. Export formats, verbs, calls and modules
that take clips are read from the registries and from the source; one that is not walked here fails.
"""

from __future__ import annotations

import ast
import inspect
import io
import json
import re
import tarfile
from collections.abc import Callable, Collection, Iterable, Mapping
from pathlib import Path
from typing import Any

import av
import click
import numpy as np
import pandas as pd
import pyarrow.parquet as pq
import pytest
import xarray
from PIL import Image
from torch.utils.data import DataLoader

import flagdata
from docs.generate_cli import commands
from flagdata.core.arrays import UInt8Array
from flagdata.core.schema import Kind
from flagdata.dataset import DecodedCache, HashedSplit, clip_rows, collate
from flagdata.dataset.clip_lineage import origins_of
from flagdata.dataset.sides import clips_of
from flagdata.export import FORMATS
from flagdata.lake import Artifact, Lake
from flagdata.record import Record, RecordWriter
from flagdata.record.signals import Sensor, WindSeries
from models.training import DataSpec, inputs, load, sides_of
from tests.contract.imports import ROOT, modules, tree
from tests.contract.test_public_arguments import public_calls
from tests.program import invoke
from tests.small import TRAINING
from tests.studies.gate import FilmsOf
from tests.studies.masks.examples import batches

SIDES = {"train": (60, 2.0, 8), "validation": (120, 5.0, 4), "test": (190, 8.0, 4)}
"""Side → gray of its pictures, its wind [m/s], and its films, each of a simulation of its own."""
START, PERIOD, FRAMES = 1_577_836_800_000_000_000, 40_000_000, 14
DIVIDED = frozenset({Kind.CLIP, Kind.RECORDING})
CALLS = r"split|split_by|side|sides"
"""Names of parameters and options that choose a side."""


Walk = Callable[[Path, str, Path], set[str]]
WAYS: dict[tuple[str, ...], Walk] = {}
"""Names of a way → a function from lake, side and an empty folder to the sides that come out."""


def way(*names: str) -> Callable[[Walk], Walk]:
    def enrol(walk: Walk) -> Walk:
        WAYS[names] = walk
        return walk

    return enrol


def shown(gray: float) -> str:
    """The side that a picture is of."""
    return min(SIDES, key=lambda side: abs(SIDES[side][0] - gray))


def blown(wind: float) -> str:
    """The side that a wind is of."""
    return min(SIDES, key=lambda side: abs(SIDES[side][1] - wind))


def film(gray: int, number: int) -> UInt8Array:
    """(frames, 32, 32): waves of a phase of their own about a gray."""
    t, y, x = np.mgrid[0:FRAMES, 0:32, 0:32]
    waves = np.cos(0.5 * x - 0.9 * t + number) * np.exp(-(((y - 16) / 10) ** 2))
    return (gray + 12 * waves).astype(np.uint8)


def write_film(path: Path, gray: int, wind: float, number: int) -> None:
    times = START + np.arange(FRAMES, dtype=np.int64) * PERIOD
    with RecordWriter(path, metadata={"camera": {"name": "made"}}) as record:
        for time, frame in zip(times.tolist(), film(gray, number), strict=True):
            record.frame(log_time=time, publish_time=time, timestamp=time, image=frame)
        seconds = START + np.arange(-70, 2, dtype=np.int64) * 1_000_000_000
        speeds = {"wind_speed": np.full(len(seconds), wind)}
        flags = np.zeros(len(seconds), dtype=np.uint16)
        record.wind(
            WindSeries(time=seconds, channels=speeds, flags=flags, sensor=Sensor(name="cup"))
        )
        record.truth({"wind_speed": wind, "area_weight": 0.1 + 0.01 * (number % 7)}, log_time=START)


@pytest.fixture(scope="module")
def lake(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The data set "made": a mesh sequence, a film and its clip for each simulation; tagged v1."""
    path = tmp_path_factory.mktemp("sides") / "lake"
    made = Lake.create(path)
    number = 0
    for side, (gray, wind, count) in SIDES.items():
        with made.transaction(f"build made: {side}") as transaction:
            for index in range(count):
                number += 1
                staged = transaction.staging(".mcap")
                write_film(staged, gray, wind + 0.05 * index, number)
                stored = transaction.put(staged)
                sequence = Artifact(
                    kind=Kind.MESHES,
                    name=f"made-{side}-{index % 2:02d}-{index:05d}",
                    seed=number,
                    recipe={"of": "made"},
                )
                recording = Artifact(
                    kind=Kind.RECORDING,
                    name=f"made-{side}-{index:05d}",
                    parents=(sequence.id,),
                    dataset="made",
                    side=side,
                    seed=number,
                    object=stored,
                    recipe={"film": number},
                    start=START,
                    end=START + (FRAMES - 1) * PERIOD,
                    frame_count=FRAMES,
                    rate=1e9 / PERIOD,
                )
                transaction.add(sequence)
                transaction.add(recording)
                for clip in clip_rows(Record.open(made.object_path(stored)), recording, frames=12):
                    transaction.add(clip)
    made.tag("v1")
    (path.parent / "small.toml").write_text(TRAINING)
    return path


@way("pairs")
def by_call(lake: Path, side: str, folder: Path) -> set[str]:
    pairs = flagdata.pairs(lake, at="v1", split=side)
    films = {shown(pairs.film(k).mean()) for k in range(len(pairs))}
    return (
        films
        | {shown(float(pairs[k].clip.float().mean())) for k in range(len(pairs))}
        | winds(pairs.table.wind)
    )


@way("Source.pairs")
def by_loaders(lake: Path, side: str, folder: Path) -> set[str]:
    """The loader alone and by threads, from the cache of decoded clips, and torch's own."""
    cache = DecodedCache(folder / "cache", limit=1 << 24)
    pairs = flagdata.open(lake).pairs({"dataset": "made"}, split=side, cache=cache)
    seen: set[str] = set()
    for workers in (0, 2, 2):
        for batch in pairs.loader(3, workers=workers):
            seen |= {shown(float(clip.float().mean())) for clip in batch.clip} | winds(
                batch.wind.numpy()
            )
    for batch in DataLoader(pairs, batch_size=2, collate_fn=collate):
        seen |= {shown(float(clip.float().mean())) for clip in batch.clip}
    return seen


@way("Source.sides")
def by_sizes(lake: Path, side: str, folder: Path) -> set[str]:
    sizes = flagdata.open(lake).sides()
    assert {name: size.recordings for name, size in sizes.items()} == {
        name: SIDES[name][2] for name in SIDES
    }
    return {side}


def winds(values: Iterable[float]) -> set[str]:
    return {blown(float(wind)) for wind in values}


def pictures(data: Iterable[bytes]) -> set[str]:
    return {
        shown(np.asarray(Image.open(io.BytesIO(picture)).convert("L")).mean()) for picture in data
    }


def of_shards(folder: Path) -> set[str]:
    seen: set[str] = set()
    for shard in folder.glob("*.tar"):
        with tarfile.open(shard) as members:
            files = [(member.name, members.extractfile(member)) for member in members]
            contents = [(name, file.read()) for name, file in files if file is not None]
        seen |= pictures(data for name, data in contents if name.endswith(".jpg"))
        labels = [json.loads(data) for name, data in contents if name.endswith(".json")]
        seen |= winds(label["wind"] for label in labels) | {label["side"] for label in labels}
    return seen


def of_parquet(folder: Path) -> set[str]:
    rows = pq.read_table(folder / "rows").to_pylist()
    return {row["side"] for row in rows} | winds(row["wind"] for row in rows)


def of_lerobot(folder: Path) -> set[str]:
    rows = pq.read_table(folder / "data").to_pylist()
    info = json.loads((folder / "meta" / "info.json").read_text())
    assert [*info["splits"].values()] == [f"0:{info['total_episodes']}"]
    assert info["flagdata"]["split_by"]["rule"] == "stated"
    of_pictures = pictures(row["observation.images.camera"]["bytes"] for row in rows)
    return of_pictures | winds(row["observation.wind_speed"] for row in rows) | set(info["splits"])


def of_films(folder: Path) -> set[str]:
    seen: set[str] = set()
    for path in folder.glob("*.mp4"):
        with av.open(str(path)) as container:
            seen |= {
                shown(frame.to_ndarray(format="gray").mean()) for frame in container.decode(video=0)
            }
    return seen


def of_records(folder: Path) -> set[str]:
    records = [Record.open(path) for path in folder.rglob("*.mcap")]
    return {shown(record.frames(0, record.frame_count).mean()) for record in records}


def of_groups(folder: Path) -> set[str]:
    seen: set[str] = set()
    for path in folder.glob("*.zarr"):
        with xarray.open_zarr(path, consolidated=False) as group:
            seen |= {shown(float(group["image"].mean()))} | winds(group["wind_speed"].values)
    return seen


def of_winds(folder: Path) -> set[str]:
    tables = [pd.read_csv(path) for path in folder.glob("*.csv")]
    return {
        side
        for table in tables
        for side in winds(table[next(c for c in map(str, table) if c.startswith("wind_speed"))])
    }


READERS: dict[str, tuple[Callable[[Path], set[str]], Kind, tuple[str, ...]]] = {
    "webdataset": (of_shards, Kind.CLIP, ()),
    "parquet": (of_parquet, Kind.CLIP, ()),
    "lerobot": (of_lerobot, Kind.CLIP, ("--frames", "png")),
    "mp4": (of_films, Kind.CLIP, ()),
    "mcap": (of_records, Kind.CLIP, ()),
    "zarr": (of_groups, Kind.CLIP, ()),
    "csv": (of_winds, Kind.RECORDING, ()),
}
"""Format → what reads the sides that its files show, and what is exported by which options."""


@way("export", "flagdata export")
def by_exports(lake: Path, side: str, folder: Path) -> set[str]:
    """Every format that holds clips: its files, its manifest and its Croissant description."""
    seen: set[str] = set()
    for form, (read, kind, options) in READERS.items():
        chosen = ("--where", f"kind = '{kind}'", "--at", "v1", "--split", side, *options)
        ended = invoke("export", form, "--lake", str(lake), "--to", str(folder / form), *chosen)
        assert ended.code == 0, ended.err
        sides = read(folder / form)
        assert sides, form
        manifest = json.loads((folder / form / "manifest.json").read_text())
        assert (manifest["split"], manifest["split_by"]["rule"]) == (side, "stated")
        assert manifest["split_by"]["datasets"] == ["made"]
        sizes = {name: of["recordings"] for name, of in manifest["split_by"]["sides"].items()}
        assert sizes == {name: count for name, (_, _, count) in SIDES.items()}
        about = json.loads((folder / form / "croissant.json").read_text())["description"]
        assert f"side {side} of the split" in about
        assert "Sides, stated by made: train" in about
        seen |= sides
    return seen


class Spy:
    """Records which pairs are prepared for a network, by their winds."""

    def __init__(self, patch: pytest.MonkeyPatch) -> None:
        self.seen: dict[str, set[str]] = {}
        for name in ("prepare_films", "prepare_clips"):
            patch.setattr(inputs, name, self._spied(name, getattr(inputs, name)))

    def _spied(self, name: str, prepare: Callable[..., Any]) -> Callable[..., Any]:
        def spied(pairs: Any, *arguments: Any, **options: Any) -> Any:
            prepared = prepare(pairs, *arguments, **options)
            seen = self.seen.setdefault(name, set())
            seen |= winds(pairs.table.wind) | winds(prepared.truth(("wind_speed",))[:, 0])
            return prepared

        return spied


@pytest.fixture(scope="module")
def network(lake: Path) -> Mapping[str, Any]:
    """What `flagdata train` says of the small network, and what it prepared."""
    with pytest.MonkeyPatch.context() as patch:
        spy = Spy(patch)
        trained = invoke(
            "train",
            str(lake.parent / "small.toml"),
            "--at",
            "v1",
            "--lake",
            str(lake),
            "--workers",
            "1",
        )
        assert trained.code == 0, trained.err
    card = invoke(
        "train", str(lake.parent / "small.toml"), "--at", "v1", "--lake", str(lake), "--json"
    ).document
    return {"seen": spy.seen, **card}


@way("evaluate", "flagdata evaluate")
def by_evaluation(lake: Path, side: str, folder: Path) -> set[str]:
    with pytest.MonkeyPatch.context() as patch:
        spy = Spy(patch)
        judged = invoke(
            "evaluate",
            "small",
            "--dataset",
            "made",
            "--side",
            side,
            "--lake",
            str(lake),
            "--out",
            str(folder),
            "--json",
        )
        assert judged.code == 0, judged.err
    assert judged.document["split"] == side
    assert judged.document["split_by"]["rule"] == "stated"
    return set().union(*spy.seen.values())


@way("sides_of")
def by_training(lake: Path, side: str, folder: Path) -> set[str]:
    pairs = sides_of(flagdata.open(lake), load(str(lake.parent / "small.toml")), side, at="v1")
    return {shown(float(pairs[k].clip.float().mean())) for k in range(len(pairs))}


@way("FilmsOf")
def by_gate(lake: Path, side: str, folder: Path) -> set[str]:
    return {
        shown(frames.mean())
        for frames in FilmsOf(lake, DataSpec(datasets=("made",)), side, at="v1")
    }


@way("batches")
def by_masks(lake: Path, side: str, folder: Path) -> set[str]:
    """Sequences that films of the side were made from, and no others: their objects are their names
    here."""
    opened = Lake.open(lake)
    with pytest.MonkeyPatch.context() as patch:
        table = opened.table(opened.view(None))
        named = table.set_column(table.column_names.index("object"), "object", table["name"])
        patch.setattr(opened, "table", lambda view: named)
        return {
            name.split("-")[1] for batch in batches(opened, ["made"], side=side) for name in batch
        }


CALLERS = {
    "flagdata/api/lakes.py": ("pairs",),
    "flagdata/dataset/tagged.py": ("the note of a tag, of all clips",),
    "flagdata/dataset/resolve.py": ("Source.pairs", "Source.sides"),
    "flagdata/export/export_plan.py": ("flagdata export",),
    "measure/demo/recording_page.py": (
        "the one recording of the demo, of which no side is asked for",
    ),
    "models/evaluation/evaluate_command.py": ("flagdata evaluate",),
    "models/training/train_command.py": ("sides_of",),
    "tests/studies/gate.py": ("FilmsOf",),
    "tests/studies/masks/command.py": ("batches",),
    "tests/studies/shipping.py": ("sides_of",),
    "tests/studies/validation/datasets.py": ("Source.pairs",),
    "tests/studies/validation/gate.py": ("FilmsOf",),
    "tests/studies/validation/hanging_cloth.py": ("Source.pairs",),
    "tests/studies/validation/refinement.py": ("Source.pairs",),
}
"""Module that takes clips or sides → the way by which it does, or why it asks for no side."""
TAKING = {
    "flagdata.dataset.sides": {"divide", "hashed_sides", "stated_sides"},
    "models.training": {"sides_of"},
    "tests.studies.gate": {"FilmsOf"},
    "tests.studies.masks.examples": {"batches"},
}
"""Module → what it has that takes clips or decides sides, beside the method `pairs`."""


def takes(path: Path) -> bool:
    """Whether a module calls `pairs` of a lake, or imports one of `TAKING`."""
    nodes = list(ast.walk(tree(path)))
    if any(
        isinstance(node, ast.ImportFrom)
        and TAKING.get(str(node.module), set()) & {alias.name for alias in node.names}
        for node in nodes
    ):
        return True
    called = [node.func for node in nodes if isinstance(node, ast.Call)]
    return any(
        isinstance(function, ast.Attribute) and function.attr == "pairs" for function in called
    )


def chosen_by(call: Callable[..., Any]) -> Collection[str]:
    return [name for name in inspect.signature(call).parameters if re.fullmatch(CALLS, name)]


def test_every_way_to_clips_is_walked() -> None:
    """What the registries and the source have that no way walks."""
    verbs = {
        name
        for name, command in commands()
        for option in command.params
        if isinstance(option, click.Option) and re.fullmatch(CALLS, str(option.name))
    }
    calls = {name for name, call in public_calls() if chosen_by(call)} - {"Pairs.__init__"}
    assert {"flagdata export", "flagdata evaluate"} <= verbs
    assert {"pairs", "export", "evaluate", "Source.pairs", "Source.sides"} <= calls
    assert sorted((verbs | calls) - {name for names in WAYS for name in names}) == []
    product = modules("flagdata", "sim", "models", "measure")
    studies = [
        path for path in modules("tests/studies") if not path.name.startswith(("test_", "bench_"))
    ]
    callers = {str(path.relative_to(ROOT)) for path in (*product, *studies) if takes(path)}
    assert callers == set(CALLERS), "enrol it, with the way by which it takes clips"


def test_every_format_is_read_or_holds_no_clips(lake: Path, tmp_path: Path) -> None:
    divided = {name for name in FORMATS if FORMATS[name]().kinds & DIVIDED}
    assert divided == set(READERS)
    for name in set(FORMATS) - divided:
        ended = invoke(
            "export", name, "--lake", str(lake), "--to", str(tmp_path / name), "--split", "test"
        )
        assert (ended.code, "a split cannot hold" in ended.err) == (2, True), name


def test_a_hash_would_take_films_of_the_test_side_to_training(lake: Path) -> None:
    """Otherwise no way could fail."""
    opened = Lake.open(lake)
    catalog = opened.table(opened.view("v1"))
    clips = clips_of(catalog, None)
    origins = origins_of(catalog, clips)
    stated = dict(zip(clips["recording"].to_pylist(), clips["side"].to_pylist(), strict=True))
    moved = {
        (stated[origin.recording], side)
        for origin, side in zip(origins, HashedSplit().assign(origins), strict=True)
        if stated[origin.recording] != side
    }
    assert ("test", "train") in moved


@pytest.mark.parametrize("side", SIDES)
@pytest.mark.parametrize("names", WAYS, ids=", ".join)
def test_a_way_gives_the_films_of_the_side_that_their_data_set_states(
    lake: Path, network: Mapping[str, Any], tmp_path: Path, names: tuple[str, ...], side: str
) -> None:
    assert WAYS[names](lake, side, tmp_path) == {side}


def test_a_training_prepares_the_sides_that_it_is_for_and_its_card_says_how_they_were_decided(
    lake: Path, network: Mapping[str, Any]
) -> None:
    assert network["seen"] == {"prepare_films": {"train"}, "prepare_clips": {"validation"}}
    assert network["data"]["split_by"]["rule"] == "stated"
    opened = Lake.open(lake)
    (row,) = opened.rows({"kind": Kind.NETWORK}).to_pylist()
    sides = opened.rows({"artifact": row["parents"]}, columns=["side"])["side"].to_pylist()
    assert set(sides) == {"train", "validation"}
