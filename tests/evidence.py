"""Results worth keeping: what was measured, on what hardware, with which versions, commit and seed."""

from __future__ import annotations

import argparse
import json
import os
import platform
import time
from collections.abc import Mapping
from importlib import import_module
from importlib.metadata import version
from pathlib import Path
from typing import Any

from flagdata.provenance import code_version
from flagdata.timebase import NANOSECONDS, iso

REFERENCE = Path(os.environ.get("FLAGDATA_REFERENCE", Path(__file__).resolve().parents[2] / "shared" / "data"))
"""The folder of real recordings and of others' results, which may be absent; it is not part of the project."""
ABSENT = {"left_out": "no reference data; set FLAGDATA_REFERENCE to their folder"}
"""Result of what needs it."""
_VERSIONS = ("numpy", "scipy", "torch", "pyarrow", "deltalake", "zarr", "mcap", "av", "duckdb")


def _processor() -> str:
    info = Path("/proc/cpuinfo")
    if info.exists():
        for line in info.read_text().splitlines():
            if line.startswith("model name"):
                return line.partition(":")[2].strip()
    return platform.processor() or platform.machine()


def circumstances(seed: int) -> dict[str, Any]:
    return {
        "processor": _processor(),
        "cores": len(os.sched_getaffinity(0)),
        "python": platform.python_version(),
        "versions": {name: version(name) for name in _VERSIONS},
        "code_version": code_version(),
        "measured": iso(time.time_ns() // NANOSECONDS * NANOSECONDS),
        "seed": seed,
    }


def run_all(kind: str, modules: Mapping[str, str]) -> Path:
    """Command line shared by benchmarks and validation: run each named module's `run(seed)`, keep its dictionary.

    Args:
        kind: "bench" or "validate", the first part of the file names.
        modules: name → module with `run(*, seed: int, out: Path) -> dict`; pictures it makes go into `out`.

    Returns:
        The folder with the results.
    """
    parser = argparse.ArgumentParser(description=f"Run the {kind} suite and keep its results.")
    parser.add_argument("names", nargs="*", help=f"which to run, of {', '.join(modules)}; all if none is named")
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args()
    unknown = set(options.names) - set(modules)
    if unknown:
        parser.error(f"unknown: {', '.join(sorted(unknown))}; known: {', '.join(modules)}")
    options.out.mkdir(parents=True, exist_ok=True)
    for name in options.names or modules:
        result = import_module(modules[name]).run(seed=options.seed, out=options.out)
        document = {"name": name, "circumstances": circumstances(options.seed), "result": result}
        target = options.out / f"{kind}-{name}.json"
        target.write_text(json.dumps(document, indent=2, allow_nan=False, ensure_ascii=False) + "\n")
        print(f"{target}\n{json.dumps(result, indent=2)}")  # noqa: T201
    return options.out
