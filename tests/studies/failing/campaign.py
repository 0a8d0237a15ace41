"""Every call of every writing command fails in turn, or kills it: `python -m tests.studies failing
--out FILE`.

Results of commands that were tried before stay in FILE, a JSON file, so that a campaign can be run
in parts; beside it a page of the same name shows them.
"""

from __future__ import annotations

import argparse
import json
import tempfile
import time
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from contextlib import ExitStack
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from tests.evidence import circumstances
from tests.studies.failing import scenes, slow
from tests.studies.failing.groups import grouped
from tests.studies.failing.injector import Fault, Injector, injecting
from tests.studies.failing.scenes import Scene
from tests.studies.failing.trial import Command, Trials
from tests.studies.failing.verbs import COMMANDS

_ABOUT = (
    "One call on a file of the work folder (open, read, stat, map, write, flush, rename, link, "
    "remove, lock) fails, "
    "alone or with all later calls, or the command is killed before it. Calls are alike where they "
    "are the same "
    "function on files of one role (numbers, hashes and identities of a path aside) after a "
    "publication of one role. "
    "Of each such kind the first call, the last one and every so many are tried, and every call "
    "after the last "
    "publication; with 1 every call is. Where `drawn_of` is given, the trials were drawn at random "
    "from so many. "
    "Threads make their calls in another order each time: counted is what did fail, and a kind "
    "whose every call was "
    "made at another place is untried. The JSON file beside this page states of each kind how many "
    "calls there are "
    "and how many failed. A report is right where exit code 0 means that all is published, and "
    "exit code 1, with a "
    "fix, that it is not. Of every fourth failure the command is given once more, of every kill "
    "always, and must end "
    "as an undisturbed one, once what it says that has to go is deleted. After each trial the lake "
    "is examined "
    "(doctor, verify); silent is a command that has begun to erase, expire or delete, has not done "
    "it, and of which "
    "doctor reports nothing. For close-loop, propose and build the computing was done once and its "
    "result taken; "
    "their reads and writes are their own."
)
_KINDS = ("silent", "unhealthy", "unforeseen")
REPEATED = 4
"""Of so many commands that failed one is given once more, without the fault."""
SCENES: Mapping[str, tuple[Callable[[Path], Scene], Mapping[str, Command]]] = {
    "core": (scenes.core, COMMANDS),
    **slow.SCENES,
}
"""Scenes, each with its commands."""


def tried(
    command: Command,
    scene: Scene,
    injector: Injector,
    scratch: Path,
    *,
    every: int,
    stays: bool,
    first: int = 0,
    at_most: int | None = None,
    seed: int = 0,
) -> dict[str, Any]:
    """Faults of a command, and what was wrong with any.

    Args:
        every: of calls that are alike every so many before the publication; after it all fail.
        stays: whether trials in which all later calls fail are made too.
        first: call that the first trial is of.
        at_most: trials; of more so many are drawn at random. None makes all.
        seed: of the draw.
    """
    begun = time.monotonic()
    trials = Trials(command, scene.folder, scene.ids, injector, scratch)
    total, published = trials.whole.done.calls, trials.whole.published
    groups = grouped(trials.whole.done.trace, every=every, last=published)
    calls = sorted(n for group in groups.values() for n in group.tried if n >= first)
    faults = [
        Fault(call=n, stays=held) for n in calls for held in ((False, True) if stays else (False,))
    ]
    planned = len(faults)
    if at_most is not None and planned > at_most:
        drawn = np.random.default_rng(seed).choice(planned, at_most, replace=False)
        faults = [faults[place] for place in sorted(drawn)]
    wrong = []
    for number, fault in enumerate(faults):
        if (found := trials.wrong(fault, repeated=number % REPEATED == 0)) is not None:
            wrong.append(found)
            print(json.dumps(found, indent=1), flush=True)  # noqa: T201
    return {
        "calls": total,
        "after_publication": total - 1 - published,
        "trials": len(faults),
        "every": every,
        "alike": len(groups),
        "untried": len(groups.keys() - trials.failed.keys()),
        "wrong": len(wrong),
        "kinds": _counted(wrong),
        "seconds": round(time.monotonic() - begun),
        **({"drawn_of": planned} if planned > len(faults) else {}),
        "groups": {
            kind: [len(groups[kind].calls) if kind in groups else 0, trials.failed[kind]]
            for kind in (*groups, *(trials.failed.keys() - groups.keys()))
        },
    }


def killed(
    command: Command, scene: Scene, injector: Injector, scratch: Path, *, points: int
) -> dict[str, Any]:
    """A command that is killed at so many of its calls, spread evenly, and given once more; what
    was wrong with any."""
    begun = time.monotonic()
    trials = Trials(command, scene.folder, scene.ids, injector, scratch)
    total = trials.whole.done.calls
    wrong = []
    for call in sorted({total * point // points for point in range(points)}):
        if (found := trials.wrong(Fault(call=call, kills=True), repeated=True)) is not None:
            wrong.append(found)
            print(json.dumps(found, indent=1), flush=True)  # noqa: T201
    return {
        "calls": total,
        "points": points,
        "wrong": len(wrong),
        "kinds": _counted(wrong),
        "seconds": round(time.monotonic() - begun),
    }


def _counted(wrong: Sequence[Mapping[str, Any]]) -> dict[str, int]:
    """How often each kind of problem was found."""
    return dict(
        Counter(problem.partition(":")[0] for found in wrong for problem in found["problems"])
    )


def campaign(
    names: Sequence[str],
    results: Path,
    *,
    seed: int,
    scenes: Path | None = None,
    every: int = 1,
    stays: bool = True,
    first: int = 0,
    at_most: int | None = None,
    kills: int | None = None,
    real: bool = False,
) -> dict[str, Any]:
    """Try commands, note the results of each in a JSON file, and return all that the file holds.

    Args:
        names: of the commands; none names all.
        scenes: folder in which scenes are kept for a later campaign; None makes them anew.
        every, stays, first, at_most: as of `tried`.
        kills: points at which commands are killed; None lets calls fail.
        real: whether nothing stands in for computing.
    """
    known: dict[str, Any] = json.loads(results.read_text()) if results.exists() else {}
    with ExitStack() as stack:
        scratch = Path(stack.enter_context(tempfile.TemporaryDirectory(prefix="failing-")))
        (scratch / "injector").mkdir()
        injector = stack.enter_context(injecting(scratch / "injector"))
        assert injector is not None, "there is no compiler, or this is no Linux"
        for group, (make, commands) in SCENES.items():
            wanted = [name for name in commands if name in names or not names]
            if not wanted:
                continue
            scene = kept_scene(scenes or scratch, group, make)
            for name in wanted:
                place = scratch / f"{group}-{name}"
                place.mkdir()
                command = replace(commands[name], stand_in=None) if real else commands[name]
                if kills is not None:
                    title, found = (
                        f"{name}, killed",
                        killed(command, scene, injector, place, points=kills),
                    )
                else:
                    title = f"{name}, alone" if not stays else name
                    found = tried(
                        command,
                        scene,
                        injector,
                        place,
                        every=every,
                        stays=stays,
                        first=first,
                        at_most=at_most,
                        seed=seed,
                    )
                title = f"computing all: {title}" if real and commands[name].stand_in else title
                known[title] = {**found, "circumstances": circumstances(seed)}
                print(  # noqa: T201
                    title,
                    {name: value for name, value in found.items() if name != "groups"},
                    flush=True,
                )
                results.write_text(json.dumps(known, indent=1, ensure_ascii=False) + "\n")
                results.with_suffix(".md").write_text(page(known))
    return known


def page(known: Mapping[str, Any]) -> str:
    """The results as Markdown."""
    tables = {
        "Calls that fail": (
            "calls",
            "after_publication",
            "alike",
            "untried",
            "every",
            "trials",
            "drawn_of",
            "wrong",
            "unhealthy",
            "unforeseen",
            "code",
        ),
        "Commands that are killed": ("calls", "points", "wrong", "silent", "unhealthy", "code"),
    }
    lines = [
        "# Calls that fail and commands that are killed",
        "",
        _ABOUT,
    ]
    for title, columns in tables.items():
        found = {
            name: result
            for name, result in known.items()
            if name.endswith(", killed") == ("points" in columns)
        }
        lines += [
            "",
            f"## {title}",
            "",
            f"| command | {' | '.join(columns)} |",
            f"|---{'|---:' * len(columns)}|",
        ]
        for name, result in found.items():
            own = {**result, "code": result["circumstances"]["code_version"]}
            shown = [
                own.get("kinds", {}).get(column, 0) if column in _KINDS else own.get(column, "")
                for column in columns
            ]
            lines.append(f"| {name.removesuffix(', killed')} | {' | '.join(map(str, shown))} |")
    if known:
        where = next(iter(known.values()))["circumstances"]
        versions = ", ".join(f"{name} {number}" for name, number in where["versions"].items())
        machine = f"{where['processor']}, {where['cores']} cores; Python {where['python']}"
        lines += ["", f"{machine}, {versions}; seed {where['seed']}."]
    return "\n".join([*lines, ""])


def kept_scene(folder: Path, group: str, make: Callable[[Path], Scene]) -> Scene:
    """The scene that is kept in a folder, or one that is made there."""
    ids = folder / f"{group}.json"
    if not ids.exists():
        (folder / group).mkdir(parents=True)
        ids.write_text(json.dumps(make(folder / group).ids))
    return Scene(folder=folder / group, ids=json.loads(ids.read_text()))


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("names", nargs="*", help="commands; all if none is named")
    parser.add_argument("--out", type=Path, required=True, help="JSON file of the results")
    parser.add_argument(
        "--scenes", type=Path, help="folder that scenes are kept in; some take minutes to make"
    )
    parser.add_argument(
        "--every", type=int, default=1, help="of calls that are alike try every so many"
    )
    parser.add_argument("--first", type=int, default=0, help="first call to try")
    parser.add_argument(
        "--at-most", type=int, metavar="N", help="of more trials make so many, drawn at random"
    )
    parser.add_argument("--alone", action="store_true", help="only calls that fail alone")
    parser.add_argument(
        "--kill", type=int, metavar="N", help="kill commands at so many calls instead"
    )
    parser.add_argument("--real", action="store_true", help="let nothing stand in for computing")
    given = parser.parse_args()
    campaign(
        given.names,
        given.out,
        seed=0,
        scenes=given.scenes,
        every=given.every,
        stays=not given.alone,
        first=given.first,
        at_most=given.at_most,
        kills=given.kill,
        real=given.real,
    )
