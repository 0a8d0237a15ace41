"""What a plain installation does, and what it says of the rest: one process in which the extras
cannot be imported."""

from __future__ import annotations

import json
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

from flagdata.core.extras import EXTRAS

ROOT = Path(__file__).resolve().parents[2]
LOG = "time,wind_speed (m/s)\n2026-05-01T12:00:00+02:00,5.1\n2026-05-01T12:00:01+02:00,5.3\n"
PROGRAM = """
import contextlib, importlib, io, json, pkgutil, sys
extras = json.loads(sys.argv[1])
class Blocked:
    def find_spec(self, name, path=None, target=None):
        if name.partition(".")[0] in extras:
            raise ModuleNotFoundError(f"No module named {name!r}", name=name)
sys.meta_path.insert(0, Blocked())
import flagdata, flagdata.cli
lacking = {}
for module in pkgutil.walk_packages(flagdata.__path__, "flagdata."):
    if module.name != "flagdata.__main__":
        try:
            importlib.import_module(module.name)
        except ModuleNotFoundError as error:
            lacking[module.name] = error.name
def ran(*arguments):
    out = io.StringIO()
    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(io.StringIO()):
        try:
            flagdata.cli.main(list(arguments))
        except SystemExit as end:
            return end.code, out.getvalue()
lake = ["--lake", "lake"]
codes = [
    ran(*verb)[0] for verb in (
        ["init", "lake"], ["ingest", "log.csv", *lake], ["ls", *lake], ["query", "--json", *lake], ["verify", *lake],
        ["export", "csv", "--to", "out", "--where", "kind = 'wind'", *lake],
        ["ingest", flagdata.example().film.as_posix(), *lake],
    )
]
try:
    flagdata.simulate()
    called = None
except flagdata.errors.MissingExtraError as error:
    called = error.fix
print(json.dumps({
    "lacking": lacking, "codes": codes, "called": called, "rows": len(flagdata.query("lake")),
    "frames": len(flagdata.frames("example:flag", end=0.2)), "wind": len(flagdata.wind("log.csv")),
    "measure": ran("measure", "example:flag", "--json"), "zarr": ran("export", "zarr", "--to", "out2", "--json", *lake),
}))
"""


@pytest.fixture(scope="module")
def light(tmp_path_factory: pytest.TempPathFactory) -> dict:
    folder = tmp_path_factory.mktemp("light")
    (folder / "log.csv").write_text(LOG)
    done = subprocess.run(
        [sys.executable, "-c", PROGRAM, json.dumps([*EXTRAS, "pandas"])],
        cwd=folder,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout.splitlines()[-1])


def test_recordings_are_brought_in_looked_at_and_handed_on_without_any_extra(light: dict) -> None:
    assert light["codes"] == [0] * 7
    assert (light["rows"], light["frames"], light["wind"]) == (2, 6, 2)


def test_only_training_data_the_export_of_zarr_and_charts_need_one(light: dict) -> None:
    assert light["lacking"] == {
        "flagdata.dataset.loader": "torch",
        "flagdata.dataset.pairs": "torch",
        "flagdata.dataset.sample": "torch",
        "flagdata.export.zarr_groups": "xarray",
        "flagdata.pages.chart_drawing": "matplotlib",
    }


def test_what_is_missing_names_the_extra_on_the_command_line_and_in_python(light: dict) -> None:
    assert "pip install 'flagdata[physics]'" in light["called"]
    for verb, extra in (("measure", "physics"), ("zarr", "xarray")):
        code, out = light[verb]
        error = json.loads(out)
        assert (code, error["kind"]) == (1, "missing-extra")
        assert error["fix"].endswith(f"pip install 'flagdata[{extra}]'")


def test_every_extra_that_is_named_is_one_of_the_package() -> None:
    extras = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"][
        "optional-dependencies"
    ]
    assert set(EXTRAS.values()) <= set(extras)
