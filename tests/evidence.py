"""Results worth keeping: what was measured, on what hardware, with which versions, commit and
seed."""

from __future__ import annotations

import json
import os
import platform
import time
from importlib import import_module
from importlib.metadata import version
from pathlib import Path
from typing import Any

from flagdata.core.provenance import code_version
from flagdata.timebase import NANOSECONDS, iso

REFERENCE = Path(
    os.environ.get("FLAGDATA_REFERENCE", Path(__file__).resolve().parents[2] / "shared" / "data")
)
"""The folder of real recordings and of others' results, which may be absent; it is not part of the
project."""
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


def keep(name: str, module: str, *, kind: str, seed: int, out: Path) -> Path:
    """Runs a study and keeps what it returns, with its circumstances.

    Args:
        name: of the study, in the file's name and in the document.
        module: with `run(*, seed: int, out: Path) -> dict`; pictures it makes go into `out`.
        kind: "bench" or "validate", the first part of the file's name.

    Returns:
        The file.
    """
    out.mkdir(parents=True, exist_ok=True)
    result = import_module(module).run(seed=seed, out=out)
    document = {"name": name, "circumstances": circumstances(seed), "result": result}
    target = out / f"{kind}-{name}.json"
    target.write_text(json.dumps(document, indent=2, allow_nan=False, ensure_ascii=False) + "\n")
    print(f"{target}\n{json.dumps(result, indent=2)}")  # noqa: T201
    return target
