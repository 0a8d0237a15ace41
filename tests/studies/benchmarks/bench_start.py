"""What the program takes before its work: seconds of the processor, and the size of the wheel.

`ls` of a lake of two artifacts from its start to its end, `flagdata.open` of that lake, `flagdata
measure` of the package's example from its start to the first window, and `import torch` alone,
which is part of the third. Each run is a fresh process; the processor's time changes little with
other work on the machine.

FLAGDATA_BEFORE names another checkout to compare with: its runs alternate with this one's, so that
both meet the same machine, and the change is the median over pairs.
"""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

_ROOT = Path(__file__).resolve().parents[3]
_PAIRS = 9
_FLAG = _ROOT / "flagdata" / "examples" / "flag"
_AIMS = {"ls": 0.6, "open": 0.5, "measure": 1.5}
_LARGEST = 6.0  # MB
_PROGRAMS = {
    "ls": """
from flagdata.cli import main
try:
    main(["ls", "--json", "--lake", sys.argv[1]])
except SystemExit as end:
    assert not end.code
""",
    "open": """
import flagdata
flagdata.open(sys.argv[1])
""",
    "measure": """
from flagdata.cli import main
from measure.estimate import run
class Begun(BaseException):
    pass
def begins(*given, **options):
    raise Begun
run.measure = begins
try:
    main(["measure", sys.argv[2], "--flag-size", "1.5x1.0"])
except Begun:
    pass
""",
    "import torch": "import torch\n",
}
_TIMED = (
    "import sys, time\n{program}\nprint(f'\\n{{time.process_time():.3f}}', file=sys.__stdout__)\n"
)


def run(*, seed: int, out: Path) -> dict[str, Any]:
    """Seconds of the processor of each start, and megabytes of the wheel; nothing is written into
    `out`."""
    del seed, out
    before = os.environ.get("FLAGDATA_BEFORE")
    with tempfile.TemporaryDirectory() as folder:
        lake = Path(folder) / "lake"
        for arguments in (
            ["init"],
            ["ingest", str(_FLAG / "anemometer.csv")],
            ["ingest", str(_FLAG / "flag.mp4")],
        ):
            command = [sys.executable, "-m", "flagdata.cli", *arguments, "--lake", str(lake)]
            subprocess.run(command, cwd=_ROOT, check=True, capture_output=True)
        return {
            "load": os.getloadavg()[0],
            "pairs": _PAIRS,
            "seconds": {name: _paired(name, lake, before) for name in _PROGRAMS},
            "wheel": {"megabytes": _wheel(Path(folder)), "aim": _LARGEST},
        }


def _paired(name: str, lake: Path, before: str | None) -> Mapping[str, float]:
    places = {"now": _ROOT} | ({} if before is None else {"before": Path(before)})
    for place in places.values():
        _seconds(name, lake, place)  # the first run compiles bytecode
    runs = {which: [] for which in places}
    for _ in range(_PAIRS):
        for which, place in places.items():
            runs[which].append(_seconds(name, lake, place))
    found = {which: float(np.median(values)) for which, values in runs.items()}
    if "before" in runs:
        found["change"] = float(np.median(np.array(runs["now"]) - runs["before"]))
    return found | ({"aim": _AIMS[name]} if name in _AIMS else {})


def _seconds(name: str, lake: Path, place: Path) -> float:
    done = subprocess.run(
        [
            sys.executable,
            "-c",
            _TIMED.format(program=_PROGRAMS[name]),
            str(lake),
            str(_FLAG / "flag.mp4"),
        ],
        cwd=place,
        env={**os.environ, "PYTHONPATH": str(place)},
        check=True,
        capture_output=True,
        text=True,
    )
    return float(done.stdout.splitlines()[-1])


def _wheel(folder: Path) -> float:
    """Of the committed files [MB]."""
    source = folder / "source"
    subprocess.run(["git", "clone", "--quiet", str(_ROOT), str(source)], check=True)
    command = [
        sys.executable,
        "-m",
        "pip",
        "wheel",
        "--quiet",
        "--no-deps",
        "--no-build-isolation",
        "-w",
        str(folder),
    ]
    subprocess.run([*command, str(source)], check=True, capture_output=True)
    (built,) = folder.glob("*.whl")
    return built.stat().st_size / 1e6
