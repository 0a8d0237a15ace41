"""The package of docs/extending.md, as if it were installed: an effect, a log format, a data set, a
network and a renderer from outside, by public names alone, each used by its command."""

from __future__ import annotations

import ast
import re
import sys
import tomllib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
import torch

import flagdata
from flagdata import extend
from flagdata.errors import InputError
from flagdata.ingest import FORMATS
from flagdata.lake import Lake
from flagdata.recipes.registry import PlugInError, Registry
from models.networks.learner import Loss, build
from models.networks.networks_by_name import NETWORKS
from sim.datasets import DATASETS
from sim.effects import EFFECTS
from sim.render import RENDERERS
from tests.docs.pages import DOCS, blocks, files
from tests.models.conftest import fill
from tests.program import invoke

PAGE = "extending.md"
REGISTRIES: dict[str, Registry] = {
    "flagdata.effects": EFFECTS,
    "flagdata.formats": FORMATS,
    "flagdata.datasets": DATASETS.registry,
    "flagdata.networks": NETWORKS,
    "flagdata.renderers": RENDERERS,
}
PUBLIC = {"flagdata.extend", "flagdata.errors", "flagdata.timebase"}
TAKEN = {
    "flagdata.effects": "lift",
    "flagdata.formats": "toa5",
    "flagdata.datasets": "flagsim",
    "flagdata.networks": "wave",
    "flagdata.renderers": "raster",
}
"""A name of flagdata's own in each group."""


def shown() -> dict[str, str]:
    """Name → text of the files that the page shows, the log format's page included."""
    return {"calmlog.py": files("wind-formats.md")["calmlog.py"], **files(PAGE)}


def installed(
    folder: Path, points: dict[str, dict[str, str]], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Makes what lies in a folder importable, with entry points as if it were installed."""
    info = folder / "meadow-1.0.dist-info"
    info.mkdir()
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: meadow\nVersion: 1.0\n")
    lines = [
        f"[{group}]\n" + "".join(f"{k} = {v}\n" for k, v in entries.items())
        for group, entries in points.items()
    ]
    (info / "entry_points.txt").write_text("\n".join(lines))
    monkeypatch.syspath_prepend(str(folder))
    for registry in REGISTRIES.values():
        monkeypatch.setattr(registry, "_found", None)


@pytest.fixture
def meadow(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """The page's package."""
    folder = tmp_path / "site"
    for name, text in shown().items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_text(text, encoding="utf-8")
    project = tomllib.loads(shown()["pyproject.toml"])["project"]
    installed(folder, project["entry-points"], monkeypatch)
    yield folder
    for name in [*sys.modules]:
        if name.partition(".")[0] in ("meadow", "calmlog"):
            del sys.modules[name]


def test_the_package_of_the_page_imports_public_names_alone_and_adds_one_of_each_kind() -> None:
    imported = {
        node.module
        for name, text in shown().items()
        if name.endswith(".py")
        for node in ast.walk(ast.parse(text))
        if isinstance(node, ast.ImportFrom) and node.module is not None
        if node.module.partition(".")[0] in ("flagdata", "sim", "models", "measure")
        and node.module != "flagdata"
    }
    assert imported <= PUBLIC
    assert "flagdata.extend" in imported
    points = tomllib.loads(shown()["pyproject.toml"])["project"]["entry-points"]
    assert set(points) == set(REGISTRIES) == set(extend.GROUPS)


def test_the_page_lists_the_public_names_and_each_leads_to_something() -> None:
    table = (
        (DOCS / PAGE).read_text(encoding="utf-8").partition("## What `flagdata.extend` holds")[2]
    )
    assert set(re.findall(r"`(\w+)`", table)) == {*dir(extend)}
    assert all(getattr(extend, name) is not None for name in dir(extend))
    with pytest.raises(AttributeError, match="ForceEfect"):
        _ = extend.ForceEfect


def test_an_effect_a_data_set_and_a_renderer_from_outside_are_used_by_build(
    meadow: Path, tmp_path: Path
) -> None:
    assert "Drag of a fringe of threads on the cloth" in invoke("catalog", "effects").out
    assert "Flags with a fringe, as dots" in invoke("catalog", "datasets").out
    planned = invoke(
        "build", "meadow", "--lake", tmp_path / "lake", "--plan", "--workers", 1, "--json"
    )
    assert planned.code == 0, planned.err
    assert planned.document["films"] == {"train": 6, "validation": 2, "test": 2}
    names: dict[str, Any] = {}
    exec(compile(blocks(PAGE, "python")[0], PAGE, "exec"), names)
    assert {int(value) for value in torch.from_numpy(names["film"].images).unique()} == {0, 255}
    plain = {**names, "effects": {}}
    exec("bare = flagdata.simulate(scene={'columns': 6}, wind={'speed': 4.0})", plain)
    assert (plain["bare"].positions != names["flags"].positions).any()


def test_a_log_format_from_outside_is_used_by_ingest(meadow: Path, tmp_path: Path) -> None:
    log, lake = tmp_path / "calm.log", Lake.create(tmp_path / "lake")
    log.write_text(
        "".join(f"CALM 2026-05-01T12:00:{second:02d}Z 4.{second % 10}\n" for second in range(30))
    )
    done = invoke("ingest", log, "--lake", lake.path)
    assert done.code == 0, done.err
    (row,) = Lake.open(lake.path).rows("kind = 'wind'").to_pylist()
    assert flagdata.wind(row["artifact"], lake=lake.path).speed.tolist() == [
        4 + second % 10 / 10 for second in range(30)
    ]


def test_a_network_from_outside_is_used_by_train(meadow: Path, tmp_path: Path) -> None:
    lake = Lake.create(tmp_path / "lake")
    fill(lake, "meadow")
    done = invoke("train", meadow / "restless.toml", "--lake", lake.path, "--workers", 1, "--json")
    assert done.code == 0, done.err
    (row,) = Lake.open(lake.path).rows("kind = 'network'").to_pylist()
    assert row["name"] == "restless"


@pytest.mark.parametrize("group", REGISTRIES)
def test_a_name_of_flagdata_and_what_is_no_such_thing_are_refused_with_the_package(
    group: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    installed(tmp_path, {group: {TAKEN[group]: "math:pi", "odd": "math:pi"}}, monkeypatch)
    for name in (TAKEN[group], "odd"):
        with pytest.raises(PlugInError, match="package meadow"):
            DATASETS.named(name) if group == "flagdata.datasets" else REGISTRIES[group][name]


def test_a_network_that_states_no_length_of_its_embedding_is_refused_with_what_to_add(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "unmeasured.py").write_text(
        "from torch import nn\nclass Unmeasured(nn.Identity):\n    takes = 'frames'\n    recurrent "
        "= False\n"
    )
    installed(tmp_path, {"flagdata.networks": {"unmeasured": "unmeasured:Unmeasured"}}, monkeypatch)
    with pytest.raises(InputError, match=r"lacks one of .* flagdata\.extend\.Network"):
        build(
            "unmeasured",
            {},
            loss=Loss.REGRESSION,
            targets=("wind_speed",),
            components=1,
            margin=1.0,
        )
    del sys.modules["unmeasured"]
