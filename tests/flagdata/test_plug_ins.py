"""Packages that add effects and formats by entry points: a defect of one is named with its package,
and stops nothing else."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from importlib.metadata import entry_points
from pathlib import Path

import pytest

from flagdata.cli import NAMES
from flagdata.commands.catalog_names import titles
from flagdata.ingest import FORMATS, sniff
from flagdata.recipes.registry import PlugInError, Registry
from sim.effects import EFFECTS
from tests.program import invoke

Install = Callable[..., None]
PACKAGE = "anothers-plug-ins"
EFFECT = """
from sim.effects.lift import Lift
class {name}(Lift):
    pass
"""


@pytest.fixture
def install(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Install]:
    """Makes a package with one module and entry points, as if it were installed."""

    def install(source: str, **points: str) -> None:
        (tmp_path / "anothers.py").write_text(source)
        info = tmp_path / "anothers_plug_ins-1.dist-info"
        info.mkdir()
        (info / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {PACKAGE}\nVersion: 1\n")
        groups = [f"[flagdata.{group}]\n{target}\n" for group, target in points.items()]
        (info / "entry_points.txt").write_text("\n".join(groups))
        monkeypatch.syspath_prepend(str(tmp_path))
        assert entry_points(group=f"flagdata.{next(iter(points))}")

    for registry in (EFFECTS, FORMATS):
        monkeypatch.setattr(registry, "_found", None)
    yield install
    sys.modules.pop("anothers", None)
    for registry in (EFFECTS, FORMATS):
        registry._found = None


DEFECTS = {
    "no such module": ("", "odd = nowhere_to_be:Found"),
    "no such attribute": ("", "odd = anothers:Found"),
    "not Python": ("def (", "odd = anothers:Found"),
    "fails": ("raise RuntimeError('broken \\x1b[2J')", "odd = anothers:Found"),
    "exits": ("raise SystemExit(0)", "odd = anothers:Found"),
    "a number": ("Found = 5", "odd = anothers:Found"),
    "another class": ("class Found: pass", "odd = anothers:Found"),
    "a module": ("", "odd = anothers"),
    "name of another": (
        EFFECT.format(name="Found"),
        "lift = anothers:Found\ntoa5 = anothers:Found",
    ),
}


@pytest.mark.parametrize(("source", "point"), DEFECTS.values(), ids=DEFECTS)
@pytest.mark.parametrize("kind", ["effects", "log-formats"])
def test_a_plug_in_that_cannot_be_used_is_named_with_its_package_and_the_others_are_listed(
    source: str, point: str, kind: str, install: Install
) -> None:
    whole = set(titles(NAMES[kind][0]))
    for registry in (EFFECTS, FORMATS):
        registry._found = None
    install(source, **{"effects" if kind == "effects" else "formats": point})
    shown = invoke("catalog", kind, "--json")
    assert shown.code == 0
    (listed,) = shown.document["kinds"]
    assert set(listed["names"]) & whole == whole - {
        line.partition(" ")[0] for line in point.splitlines()
    }
    assert "odd" not in listed["names"]
    assert PACKAGE in shown.err
    assert "\x1b" not in shown.err
    assert invoke("catalog").code == 0


def test_a_plug_in_without_any_description_is_listed(install: Install) -> None:
    install(EFFECT.format(name="Plain"), effects="plain = anothers:Plain")
    assert EFFECTS["plain"].__module__ == "anothers"
    shown = invoke("catalog", "effects")
    assert (shown.code, shown.err) == (0, "")
    assert "plain" in shown.out


def test_a_format_that_cannot_be_used_is_left_out_when_a_log_is_recognised(
    install: Install, tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    install("raise RuntimeError('broken')", formats="odd = anothers:Found")
    log = tmp_path / "log.csv"
    log.write_text("$WIMWV,214.8,R,0.1,K,A*28\n" * 5)
    assert sniff(log)[0].format == "nmea"
    assert PACKAGE in caplog.text
    with pytest.raises(PlugInError, match=PACKAGE):
        FORMATS["odd"]


def test_a_defect_of_the_programs_own_tables_is_no_plug_in() -> None:
    table = Registry("thing", {"broken": "no_such_module:x"})
    with pytest.raises(ModuleNotFoundError):
        table["broken"]
    assert table.package("broken") is None
