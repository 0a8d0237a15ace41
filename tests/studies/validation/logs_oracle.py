"""Whether wind logs are read as an earlier commit read them, to the bit: its tests are the files
and the options.

    python -m tests.studies logs-oracle record COMMIT FOLDER    # runs that commit's tests of logs, about 20 minutes
    python -m tests.studies logs-oracle compare FOLDER          # reads every file again, and counts

An entry of FOLDER is a call of `read_log`: KEY.bin the file, KEY.toml its recipe, KEY.json the
options and what came of them, KEY.npz the samples. The recording itself runs in the earlier commit,
with this module as a plugin of pytest.
"""

from __future__ import annotations

import argparse
import dataclasses
import datetime as dt
import hashlib
import io
import json
import os
import shutil
import subprocess
import sys
import tarfile
import tempfile
from collections import Counter
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

import flagdata.ingest.anemometer as package
from flagdata.core.json_values import json_values
from flagdata.errors import FlagdataError
from flagdata.ingest import WindOptions
from flagdata.ingest.anemometer import anemometer_log as module
from flagdata.ingest.anemometer.wind_options import Limits

_FOLDER = "FLAGDATA_LOGS_ORACLE"
_LARGEST = 6_000_000
"""Bytes of a file that is kept."""
_TESTS = "tests/flagdata/ingest/anemometer"
_ASKS = 3
"""Exit code of what only the user can answer."""


def _record_calls(folder: Path) -> None:
    """Put a recording reader in the place of `read_log`, before any test imports it."""
    original = module.read_log

    def recording(path: Path | str, options: WindOptions | None = None) -> Any:
        options, path = options or WindOptions(), Path(path)
        if not path.is_file() or path.stat().st_size > _LARGEST:
            return original(path, options)
        data = path.read_bytes()
        recipe = (
            Path(options.recipe).read_bytes()
            if options.recipe and Path(options.recipe).is_file()
            else None
        )
        given = {name: value for name, value in json_values(options).items() if value is not None}
        if options.limits != Limits():
            given["limits"] = dataclasses.asdict(options.limits)
        if recipe is not None:
            given["recipe"] = ""
        named = json.dumps(
            [given, path.suffix, (recipe or b"").decode(errors="replace")],
            sort_keys=True,
            default=str,
        )
        at = folder / hashlib.sha256(data + named.encode()).hexdigest()[:24]
        entry: dict[str, object] = {"name": path.name, "options": given}
        try:
            log = original(path, options)
        except FlagdataError as error:
            _keep(at, data, recipe, {**entry, "error": error.what})
            raise
        _keep(at, data, recipe, {**entry, "format": log.format, "drafted": log.drafted})
        series = log.series
        channels: dict[str, Any] = {
            f"channel:{name}": values for name, values in series.channels.items()
        }
        np.savez_compressed(
            at.with_suffix(".npz"), time=series.time, flags=series.flags, **channels
        )
        return log

    module.read_log = package.read_log = recording


def _keep(at: Path, data: bytes, recipe: bytes | None, entry: Mapping[str, object]) -> None:
    at.with_suffix(".bin").write_bytes(data)
    if recipe is not None:
        at.with_suffix(".toml").write_bytes(recipe)
    at.with_suffix(".json").write_text(json.dumps(entry, default=str))


def record(commit: str, folder: Path, tests: str = _TESTS) -> int:
    """Run the tests of logs of a commit of this repository, with every file that they read kept in
    a folder."""
    folder.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory() as made:
        tree, plugin = Path(made, "tree"), Path(made, "plugin")
        packed = subprocess.run(["git", "archive", commit], check=True, capture_output=True).stdout
        with tarfile.open(fileobj=io.BytesIO(packed)) as archive:
            archive.extractall(tree, filter="data")
        plugin.mkdir()
        shutil.copy(__file__, plugin / "logs_oracle.py")
        paths = os.pathsep.join(map(str, (tree, plugin)))
        command = [
            sys.executable,
            "-m",
            "pytest",
            "-q",
            "-p",
            "no:cacheprovider",
            "-p",
            "logs_oracle",
            tests,
        ]
        environment = {**os.environ, "PYTHONPATH": paths, _FOLDER: str(folder.resolve())}
        return subprocess.run(command, cwd=tree, env=environment, check=False).returncode


def compare(folder: Path) -> Counter[tuple[str, str]]:
    """Read every file of a folder again: (kind of entry, outcome) → how many.

    Kinds are "exact" (a maker's format or a recipe), "draft" and "refused", as they were; outcomes
    "same" (times, channels, values and flags to the bit), "asks", "refused", "reads" (what was
    refused), and what differs.
    """
    found: Counter[tuple[str, str]] = Counter()
    with tempfile.TemporaryDirectory() as made:
        for at in sorted(folder.glob("*.json")):
            entry = json.loads(at.read_text())
            outcome = _outcome(at, entry, Path(made))
            found[_kind(entry), outcome] += 1
            if _kind(entry) == "exact" and outcome != "same":
                sys.stdout.write(f"{at.stem}  {entry['format']}: {outcome}\n")
    return found


def _kind(entry: Mapping[str, Any]) -> str:
    if "error" in entry:
        return "refused"
    drafted = (
        entry["format"] == "delimited" and "recipe" not in entry["options"] and entry["drafted"]
    )
    return "draft" if drafted else "exact"


def _outcome(at: Path, entry: Mapping[str, Any], folder: Path) -> str:
    file, recipe = folder / entry["name"], folder / "recipe.toml"
    shutil.copy(at.with_suffix(".bin"), file)
    options = {
        name: value
        for name, value in entry["options"].items()
        if name in WindOptions.__dataclass_fields__
    }
    if at.with_suffix(".toml").exists():
        shutil.copy(at.with_suffix(".toml"), recipe)
        options["recipe"] = str(recipe)
    if "limits" in options:
        known = Limits.__dataclass_fields__
        options["limits"] = Limits(
            **{name: value for name, value in options["limits"].items() if name in known}
        )
    if "date" in options:
        options["date"] = dt.date.fromisoformat(options["date"])
    if "start" in options:
        options["start"] = int(options["start"])
    try:
        series = package.read_log(file, WindOptions(**options)).series
    except FlagdataError as error:
        return "asks" if error.exit_code == _ASKS else "refused"
    if "error" in entry:
        return "reads"
    old = np.load(at.with_suffix(".npz"))
    names = {name.removeprefix("channel:") for name in old.files if name.startswith("channel:")}
    if not np.array_equal(old["time"], series.time):
        return "other times"
    if names != set(series.channels):
        return "other channels"
    if not all(
        np.array_equal(old[f"channel:{name}"], series.channels[name], equal_nan=True)
        for name in names
    ):
        return "other values"
    return "same" if np.array_equal(old["flags"], series.flags) else "other flags"


def main(arguments: Sequence[str] | None = None) -> int:
    """See the module's text."""
    parser = argparse.ArgumentParser(description="wind logs as an earlier commit read them")
    steps = parser.add_subparsers(dest="step", required=True)
    first = steps.add_parser(
        "record", help="run an earlier commit's tests of logs and keep what they read"
    )
    first.add_argument("commit")
    first.add_argument("folder", type=Path)
    first.add_argument("--tests", default=_TESTS, help="of that commit, if not all")
    second = steps.add_parser("compare", help="read what was kept again")
    second.add_argument("folder", type=Path)
    given = parser.parse_args(arguments)
    if given.step == "record":
        return record(given.commit, given.folder, given.tests)
    for (kind, outcome), count in sorted(compare(given.folder).items()):
        sys.stdout.write(f"{kind:<8} {outcome:<16} {count}\n")
    return 0


if _FOLDER in os.environ:
    _record_calls(Path(os.environ[_FOLDER]))
if __name__ == "__main__":
    raise SystemExit(main())
