"""Every call of every writing command fails in turn; `python -m tests.failing.campaign --out FILE [COMMAND...]`.

Results of commands that were tried before stay in FILE, so that a campaign can be run in parts.
"""

from __future__ import annotations

import argparse
import json
import tempfile
import time
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from contextlib import ExitStack
from pathlib import Path
from typing import Any

from tests.evidence import circumstances
from tests.failing.commands import COMMANDS, Scene, made_scene
from tests.failing.injector import Fault, Injector, injecting
from tests.failing.trial import Command, Trials

REPEATED = 4
"""Of so many commands that failed one is given once more, without the fault."""
SCENES: Mapping[str, tuple[Callable[[Path], Scene], Mapping[str, Command]]] = {"core": (made_scene, COMMANDS)}
"""Scenes, each with its commands."""


def tried(
    command: Command, scene: Scene, injector: Injector, scratch: Path, *, stride: int, stays: bool, first: int = 0
) -> dict[str, Any]:
    """All faults of a command, and what was wrong with any.

    Args:
        stride: every so many calls before the publication; after it all fail.
        stays: whether trials in which all later calls fail are made too.
        first: call that the first trial is of.
    """
    begun = time.monotonic()
    trials = Trials(command, scene.folder, scene.ids, injector, scratch)
    total, published = trials.whole.done.calls, trials.whole.published
    calls = [n for n in range(first, total) if n > published or n % stride == 0]
    faults = [Fault(call=n, stays=held) for n in calls for held in ((False, True) if stays else (False,))]
    wrong = []
    for number, fault in enumerate(faults):
        if (found := trials.wrong(fault, repeated=number % REPEATED == 0)) is not None:
            wrong.append(found)
            print(json.dumps(found, indent=1), flush=True)  # noqa: T201
    kinds = Counter(problem.partition(":")[0] for found in wrong for problem in found["problems"])
    return {
        "calls": total, "after_publication": total - 1 - published, "trials": len(faults), "stride": stride,
        "wrong": len(wrong), "kinds": dict(kinds), "seconds": round(time.monotonic() - begun),
    }  # fmt: skip


def campaign(names: Sequence[str], results: Path, *, stride: int, stays: bool, first: int) -> None:
    """Try commands and note the results of each in a JSON file."""
    known: dict[str, Any] = json.loads(results.read_text()) if results.exists() else {}
    with ExitStack() as stack:
        scratch = Path(stack.enter_context(tempfile.TemporaryDirectory(prefix="failing-")))
        (scratch / "injector").mkdir()
        injector = stack.enter_context(injecting(scratch / "injector"))
        assert injector is not None, "there is no compiler, or this is no Linux"
        for title, (make, commands) in SCENES.items():
            wanted = [name for name in commands if name in names or not names]
            if not wanted:
                continue
            (scratch / title).mkdir()
            scene = make(scratch / title)
            for name in wanted:
                place = scratch / f"{title}-{name}"
                place.mkdir()
                found = tried(commands[name], scene, injector, place, stride=stride, stays=stays, first=first)
                known[name] = {**found, "circumstances": circumstances(0)}
                print(name, {**found}, flush=True)  # noqa: T201
                results.write_text(json.dumps(known, indent=1, ensure_ascii=False) + "\n")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("names", nargs="*", help="commands; all if none is named")
    parser.add_argument("--out", type=Path, required=True, help="JSON file of the results")
    parser.add_argument("--stride", type=int, default=1, help="try every so many calls before the publication")
    parser.add_argument("--first", type=int, default=0, help="first call to try")
    parser.add_argument("--alone", action="store_true", help="only calls that fail alone")
    given = parser.parse_args()
    campaign(given.names, given.out, stride=given.stride, stays=not given.alone, first=given.first)
