"""A disk that refuses any one call of any writing command: a clear error, or, once it is published,
no error at all."""

from __future__ import annotations

import json
import os
from collections.abc import Iterator
from pathlib import Path

import pytest

from flagdata.cli import GROUPS
from tests.flagdata.conftest import write_video
from tests.studies.failing import campaign, power_cut
from tests.studies.failing.groups import grouped
from tests.studies.failing.injector import Fault, Injector, injecting
from tests.studies.failing.scenes import Scene, core_scene
from tests.studies.failing.trial import Trials
from tests.studies.failing.verbs import COMMANDS

BEFORE, AFTER = 2, 2
"""How many of a command's calls fail in turn before and after it has published, spread evenly; all
of them with FLAGDATA_EVERY_CALL set. `python -m tests.studies failing` has the slow commands as
well, and kills."""
EVERY = bool(os.environ.get("FLAGDATA_EVERY_CALL"))


@pytest.fixture(scope="module")
def scene(tmp_path_factory: pytest.TempPathFactory, video: Path, wind_log: Path) -> Scene:
    return core_scene(
        tmp_path_factory.mktemp("scene"), video=video, wind_log=wind_log, write_video=write_video
    )


@pytest.fixture(scope="module")
def injector(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Injector]:
    with injecting(tmp_path_factory.mktemp("injector")) as found:
        if found is None:
            pytest.skip(
                "calls are made to fail by a library of C that Linux loads first: no compiler, or "
                "no Linux"
            )
        yield found


def spread(first: int, last: int, count: int) -> list[int]:
    """So many numbers from `first` to before `last`, the last of them among these."""
    return sorted(
        {last - 1 - (last - 1 - first) * step // count for step in range(count)}
        & {*range(first, last)}
    )


@pytest.mark.timeout(7200 if EVERY else 600)
@pytest.mark.parametrize("name", COMMANDS)
def test_a_call_that_fails_before_publication_is_an_error_and_after_it_a_warning(
    name: str, scene: Scene, injector: Injector, tmp_path: Path
) -> None:
    trials = Trials(COMMANDS[name], scene.folder, scene.ids, injector, tmp_path)
    total, published = trials.whole.done.calls, trials.whole.published
    assert total >= 4  # written, flushed, published, the folder flushed
    if EVERY:
        faults = [Fault(call=call, stays=stays) for call in range(total) for stays in (False, True)]
    else:
        calls = [*spread(0, published + 1, BEFORE), *spread(published + 1, total, AFTER)]
        faults = [*(Fault(call=call) for call in calls), Fault(call=published + 1, stays=True)]
    wrong = [found for fault in faults if (found := trials.wrong(fault, repeated=EVERY))]
    assert not wrong, json.dumps(wrong, indent=1)


NOT_TRIED = {
    **dict.fromkeys(
        ("ls", "show", "lineage", "view", "query", "log", "diff", "du", "catalog"), "only reads"
    ),
    **dict.fromkeys(
        ("verify", "doctor"), "only reads, and notes beside an object that it is damaged"
    ),
    **dict.fromkeys(("completion", "help"), "only prints"),
    "evaluate": "only reads a lake, and writes a table anew",
    "demo": "calls what other commands call",
    "blender-setup": "changes this installation alone",
}


def test_every_command_that_writes_is_tried_by_all_studies() -> None:
    every = {name for _, commands in GROUPS.values() for name in commands}
    failing = {
        command.arguments[0]
        for _, commands in campaign.SCENES.values()
        for command in commands.values()
    }
    cut = {verb.arguments[0] for _, verbs in power_cut.ALL.values() for verb in verbs.values()}
    assert failing.isdisjoint(NOT_TRIED)
    assert failing | NOT_TRIED.keys() == every
    assert cut == failing - {"propose"}  # which writes files of its own, and reads a lake


def test_of_calls_that_are_alike_the_first_the_last_and_every_so_many_are_tried_and_all_after_the_publication() -> (
    None
):
    before = [f"open /lake/mcap/{n:064x}.mcap" for n in range(8)]
    trace = [*before, "read /lake/lake.json", "link /lake/log/.0123abcd", *before[:3]]
    groups = {
        kind: (group.calls, group.tried) for kind, group in grouped(trace, every=4, last=9).items()
    }
    assert groups == {
        "open /lake/mcap/*.mcap after nothing": ((0, 1, 2, 3, 4, 5, 6, 7), (0, 4, 7)),
        "read /lake/lake.json after nothing": ((8,), (8,)),
        "link /lake/log/.* after nothing": ((9,), (9,)),
        "open /lake/mcap/*.mcap after link /lake/log/.*": ((10, 11, 12), (10, 11, 12)),
    }
