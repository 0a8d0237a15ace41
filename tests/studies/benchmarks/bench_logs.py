"""Ingesting a day of a 20 Hz sonic (TOA5, 1.7 million rows), and a small log: columns against row
by row, in one run.

Each is a process of its own, as a user starts it, and Python keeps the package's bytecode, as where
it is installed; both ways must give the same samples. Wall time is of a machine that may have other
work, processor time and memory are the process's.
"""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

import numpy as np

from flagdata.core.rng import stream
from flagdata.lake import Lake
from flagdata.record import Record

ROWS = {"day": 1_700_000, "small": 2_000}
_HEADER = (
    '"TOA5","CR3000","CR3000","1234","CR3000.Std.31","CPU:flux.CR3","4021","ts_data"',
    '"TIMESTAMP","RECORD","Ux","Uy","Uz","Ts","diag_csat","CO2_mg","H2O_g","Press"',
    '"TS","RN","m/s","m/s","m/s","C","","mg/m^3","g/m^3","kPa"',
    '"","","Smp","Smp","Smp","Smp","Smp","Smp","Smp","Smp"',
)
_WAYS = {
    "columns": "",
    "rows": "from flagdata.ingest.anemometer.text.cut_lines import RowReader; RowReader.blocks = "
    "RowReader.rows; ",
}
_PEAK = """
import atexit, sys
status = "/proc/self/status"
atexit.register(lambda: print(next(x.split()[1] for x in open(status) if x.startswith("VmHWM")), file=sys.stderr))
"""
"""The kernel's high-water mark of this program alone; `ru_maxrss` is inherited from the process
that started it."""


def run(*, seed: int, out: Path) -> dict[str, Any]:
    """Seconds and bytes of `flagdata ingest` for each log and way."""
    result: dict[str, Any] = {}
    with tempfile.TemporaryDirectory() as folder:
        for name, rows in ROWS.items():
            path = Path(folder) / f"{name}.dat"
            _write(path, rows, seed)
            result[name] = {"rows": rows, "bytes": path.stat().st_size}
            samples = []
            for way, before in _WAYS.items():
                lake = Lake.create(Path(folder) / f"{name}-{way}")
                result[name][way] = _ingest(path, lake, before)
                (row,) = lake.rows("kind = 'wind'").to_pylist()
                record = Record.open(lake.object_path(row["object"]))
                samples.append(record.device_wind_times)
            np.testing.assert_array_equal(samples[0], samples[1])
            assert len(samples[0]) == rows
    return result


def _ingest(path: Path, lake: Lake, before: str) -> dict[str, float]:
    program = f"{_PEAK}{before}from flagdata.cli import main; main(sys.argv[1:])"
    installed = {
        name: value for name, value in os.environ.items() if name != "PYTHONDONTWRITEBYTECODE"
    }
    began = time.perf_counter()
    child = subprocess.Popen(
        [
            sys.executable,
            "-c",
            program,
            "ingest",
            "--lake",
            str(lake.path),
            "--zone",
            "UTC",
            str(path),
        ],
        stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
        text=True,
        env=installed,
    )
    assert child.stderr is not None
    said = child.stderr.read()
    _, status, usage = os.wait4(child.pid, 0)
    assert status == 0, f"the ingest failed: {said}"
    return {
        "wall_seconds": time.perf_counter() - began,
        "processor_seconds": usage.ru_utime + usage.ru_stime,
        "peak_bytes": int(said.split()[-1]) * 1024,
    }


def _write(path: Path, rows: int, seed: int) -> None:
    generator = stream(seed, "log")
    wind = generator.normal(4, 1, (rows, 3))
    other = generator.normal([21, 690, 7.1], [0.3, 3, 0.2], (rows, 3))
    stamps = (
        np.datetime64("2021-05-14T00:00:00.000") + np.arange(rows) * np.timedelta64(50, "ms")
    ).astype(str)
    with path.open("w", newline="\r\n") as out:
        out.writelines(f"{line}\n" for line in _HEADER)
        for i, (stamp, (x, y, z), (t, c, h)) in enumerate(
            zip(stamps, wind.tolist(), other.tolist(), strict=True)
        ):
            text = (
                stamp.replace("T", " ").rstrip("0").rstrip(".")
                if "." in stamp
                else stamp.replace("T", " ")
            )
            first = '"NAN"' if i % 5000 == 77 else f"{x:.5f}"
            pressure = 98.7 + 1e-3 * (i % 100)
            winds = f"{first},{y:.5f},{z / 10:.5f}"
            out.write(f'"{text}",{i},{winds},{t:.5f},{i % 64},{c:.4f},{h:.5f},{pressure:.3f}\n')
