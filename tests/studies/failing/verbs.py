"""All verbs that write to a lake, each with a scene that is small enough to stop it at many places.

A study gives the places: `{lake}`, `{hurt}`, `{new}` and `{out}` of a verb's arguments are in a
folder or in a bucket.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from flagdata.errors import FlagdataError
from flagdata.lake import Lake, labels_of
from tests.studies.failing import scenes, slow
from tests.studies.failing.scenes import Scene, files
from tests.studies.failing.trial import Command

State = frozenset[tuple[str, ...]]
UNREADABLE: State = frozenset({("not readable",)})
"""What a lake shows that cannot be read."""


@dataclass(frozen=True, kw_only=True)
class Verb:
    """A command that writes to a lake.

    Attributes:
        arguments: {lake} stands for the lake's address, {hurt} for that of the same lake with
            damage, {new} for one where nothing is, {folder} for the scene's folder, {out} for one
            of the trial's own, other names in braces for the scene's ids.
        one_step: whether it changes all or nothing.
        deletes: whether data go or come back, so that the state is of objects too.
        compares, stand_in, unfinished: as of `tests.studies.failing.trial.Command`.
        target: what it writes to, {lake}, {hurt} or {new}.
        again: what goes on where it was killed and the target is there, if that is another command.
    """

    arguments: tuple[str, ...]
    one_step: bool = True
    deletes: bool = False
    compares: bool = False
    target: str = "{lake}"
    again: tuple[str, ...] | None = None
    stand_in: str | None = None
    unfinished: frozenset[str] = frozenset()


_LAKE = ("--lake", "{lake}")
CORE = {
    "init": Verb(arguments=("init", "{new}"), target="{new}"),
    "clone": Verb(
        arguments=("clone", "{folder}/ahead", "{new}"),
        target="{new}",
        one_step=False,
        again=("push", "{new}", "--lake", "{folder}/ahead"),
    ),
    "push": Verb(arguments=("push", "{lake}", "--lake", "{folder}/ahead"), one_step=False),
    "pull": Verb(arguments=("pull", "{folder}/ahead", *_LAKE), one_step=False),
    "ingest camera": Verb(arguments=("ingest", "{folder}/second.mp4", *_LAKE)),
    "ingest wind": Verb(arguments=("ingest", "{folder}/second.csv", *_LAKE)),
    "ingest meshes": Verb(arguments=("ingest", "{folder}/meshes", "--rate", "25", *_LAKE)),
    "ingest markers": Verb(arguments=("ingest", "{folder}/markers.csv", *_LAKE)),
    "ingest record": Verb(arguments=("ingest", "{folder}/record.mcap", *_LAKE)),
    "align": Verb(
        arguments=(
            "align",
            "{camera}",
            "{wind}",
            "--by",
            "given",
            "--clock-offset",
            "0",
            "--offset-sigma",
            "0.2",
            *_LAKE,
        )
    ),
    "realign": Verb(
        arguments=(
            "realign",
            "{recording}",
            "--by",
            "given",
            "--clock-offset",
            "0",
            "--offset-sigma",
            "0.3",
            *_LAKE,
        )
    ),
    "declare": Verb(arguments=("declare", "{camera}", "--speed", "3", "--sigma", "0.2", *_LAKE)),
    "declare-cloths": Verb(
        arguments=("declare-cloths", "{folder}/cloths.csv", *_LAKE), one_step=False
    ),
    "label": Verb(arguments=("label", "{camera}", "operator=me", *_LAKE)),
    "tag": Verb(arguments=("tag", "v1", *_LAKE)),
    "tag --delete": Verb(arguments=("tag", "v0", "--delete", *_LAKE)),
    "branch": Verb(arguments=("branch", "more", *_LAKE)),
    "branch --delete": Verb(arguments=("branch", "side", "--delete", "--discard", *_LAKE)),
    "merge": Verb(arguments=("merge", "side", *_LAKE)),
    "withdraw": Verb(arguments=("withdraw", "{single}", "-m", "wrong", *_LAKE)),
    "withdraw --everywhere": Verb(
        arguments=("withdraw", "{single}", "--everywhere", "-m", "wrong", *_LAKE),
        one_step=False,
        deletes=True,
        unfinished=frozenset({"erasure-unfinished"}),
    ),
    "gc": Verb(arguments=("gc", "--older-than", "0s", *_LAKE), one_step=False, deletes=True),
    "expire": Verb(
        arguments=("expire", "--keep", "1", *_LAKE),
        one_step=False,
        deletes=True,
        unfinished=frozenset({"expiry-unfinished"}),
    ),
    "heal": Verb(
        arguments=("heal", "{folder}/ahead", "--lake", "{hurt}"),
        target="{hurt}",
        one_step=False,
        deletes=True,
        compares=True,
        unfinished=frozenset({"log-damaged", "dangling-row", "object-missing"}),
    ),
    "simulate": Verb(arguments=("simulate", "{folder}/small.toml", "--workers", "1", *_LAKE)),
}
OUTSIDE = {
    "recover": Verb(arguments=("recover", "{folder}/cut.mcap", "{out}.mcap")),
    "export": Verb(arguments=("export", "parquet", "--to", "{out}", *_LAKE)),
}
"""Verbs of the same scene that write outside of a lake."""


def command(verb: Verb) -> Command:
    """A verb in a folder, with the lake `lake` there."""
    places = {name: f"{{folder}}/{name}" for name in ("lake", "hurt", "new", "out")}

    def placed(arguments: Sequence[str]) -> tuple[str, ...]:
        for name, place in places.items():
            arguments = [argument.replace(f"{{{name}}}", place) for argument in arguments]
        return tuple(arguments)

    return Command(
        arguments=placed(verb.arguments),
        state=lambda folder: state(folder / verb.target.strip("{}"), deletes=verb.deletes),
        lake=verb.target.strip("{}"),
        again=verb.again and placed(verb.again),
        one_step=verb.one_step,
        deletes=verb.deletes,
        compares=verb.compares,
        unfinished=verb.unfinished,
    )


_OF_A_TRIAL = {
    "{folder}/lake": "{lake}",
    "{folder}/out": "{out}",
    "{folder}/report": "{out}-report",
    "{folder}/answer": "{out}-answer",
}


def _slow(
    make: Callable[[Path], Scene], names: Sequence[str]
) -> tuple[Callable[[Path], Scene], dict[str, Verb]]:
    """A scene of commands that take long, with those of them that write to its lake."""
    commands = next(found for scene, found in slow.SCENES.values() if scene is make)
    verbs = {}
    for name in names:
        given = commands[name].arguments
        for there, here in _OF_A_TRIAL.items():
            given = tuple(part.replace(there, here) for part in given)
        verbs[name] = Verb(
            arguments=given, one_step=commands[name].one_step, stand_in=commands[name].stand_in
        )
    return make, verbs


SCENES: Mapping[str, tuple[Callable[[Path], Scene], Mapping[str, Verb]]] = {
    "core": (scenes.core, CORE),
    "train": _slow(slow.train_scene, ["train"]),
    "measure": _slow(slow.measure_scene, ["measure"]),
    "build": _slow(slow.build_scene, ["build"]),
    "loop": _slow(slow.loop_scene, ["close-loop"]),
    "weigh": _slow(slow.weigh_scene, ["observe", "calibrate"]),
}


def state(folder: Path, *, deletes: bool) -> State:
    """What a lake in a folder shows: rows by branch, with their labels, and by tag; and its
    objects."""
    if not (folder / "lake.json").exists():
        return frozenset({("no lake",)})
    try:
        return _shown(Lake.open(folder), deletes=deletes)
    except FlagdataError:
        return UNREADABLE


def _shown(lake: Lake, *, deletes: bool) -> State:
    found: set[tuple[str, ...]] = {("lake",)}
    for branch in ("main", *lake.refs.branches()):
        found.add(("branch", branch))
        rows = lake.rows(at=branch)
        labels = labels_of(rows)
        found |= {
            ("row", branch, one, str(labels.get(one))) for one in rows["artifact"].to_pylist()
        }
    for tag in lake.refs.tags():
        found |= {
            ("tag", tag),
            *(("tagged", tag, one) for one in lake.rows(at=tag)["artifact"].to_pylist()),
        }
    if deletes:
        found |= {("object", stored.name) for stored in lake.objects}
    return frozenset(found)


COMMANDS = {
    **{name: command(verb) for name, verb in CORE.items()},
    **{
        name: replace(command(verb), state=files("out", "out.mcap"))
        for name, verb in OUTSIDE.items()
    },
}
"""The verbs of the core, and those that write outside of a lake, in a folder."""
