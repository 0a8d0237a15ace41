"""How long a fresh process takes from a lake of 100,000 clips to its first batch, on a disk and
from a bucket.

The bucket is moto's server on loopback, the cache of objects empty: requests are answered by a
Python program beside the process that is timed. The clips are slices of one short recording; their
rows differ, as those of as many would.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa

from flagdata.core.rng import stream
from flagdata.core.schema import CLIP_FRAMES
from flagdata.lake import Lake
from tests.s3 import BUCKET, SECRETS, moto
from tests.studies.benchmarks.bench_pairs import make_recording

CLIPS = int(os.environ.get("FLAGDATA_BENCH_CLIPS", "100_000"))
RECORDED = 8  # clips' worth of frames
BATCH = 16
_WITHOUT_PANDAS = """
import sys
class Hidden:
    def find_spec(self, name, path=None, target=None):
        if name == "pandas":
            raise ModuleNotFoundError(name)
sys.meta_path.insert(0, Hidden())
"""
"""As an installation without pandas, which is none of the requirements; Arrow's data sets load it
where it is."""
_FRESH = """
import json, sys, time
wall, cpu, found = time.perf_counter(), time.process_time(), {}
def lap(what):
    global wall, cpu
    found[what] = {"wall_s": time.perf_counter() - wall, "cpu_s": time.process_time() - cpu}
    wall, cpu = time.perf_counter(), time.process_time()
import torch
import flagdata, flagdata.dataset.resolve, flagdata.dataset.loader, flagdata.dataset.pairs
lap("import")
pairs = flagdata.open(sys.argv[1]).pairs()
lap("open and resolve")
loader = pairs.loader(int(sys.argv[2]))
batch = next(iter(loader))
lap("first batch")
assert len(batch) == int(sys.argv[2])
with open("/proc/self/status") as status:
    peak = int(next(line for line in status if line.startswith("VmHWM")).split()[1]) // 1024
print(json.dumps({**found, "clips": len(pairs), "peak_MiB": peak, "order": loader.order_hash(0)}))
"""


def run(*, seed: int, out: Path) -> dict[str, Any]:
    """Seconds of wall and processor."""
    del out
    with tempfile.TemporaryDirectory() as name, moto() as address:
        folder = Path(name)
        lake = Lake.create(folder / "lake")
        fill(lake, seed)
        found = {"load_average": round(os.getloadavg()[0], 1), "disk": _fresh(str(lake.path), {})}
        found["disk, without pandas"] = _fresh(str(lake.path), {}, before=_WITHOUT_PANDAS)
        bucket = {**SECRETS, "AWS_REGION": "us-east-1", "AWS_ENDPOINT_URL": address}
        remote = f"s3://{BUCKET}/lake"
        environment = {**bucket, "FLAGDATA_CACHE": str(folder / "cache")}
        _python(
            "from tests.studies.benchmarks.bench_first_batch import *; "
            f"fill(Lake.create({remote!r}), {seed})",
            environment,
        )
        found["bucket, cold"] = _fresh(remote, {**bucket, "FLAGDATA_CACHE": str(folder / "empty")})
        found["bucket, warm"] = _fresh(remote, {**bucket, "FLAGDATA_CACHE": str(folder / "empty")})
        assert found["disk"]["clips"] == found["bucket, cold"]["clips"] == CLIPS
    return found


def fill(lake: Lake, seed: int) -> None:
    """One recording, and rows of `CLIPS` clips of it."""
    make_recording(lake, seed, clips=RECORDED)
    rows = lake.rows({"kind": "clip"})
    count = CLIPS - rows.num_rows
    draws = stream(seed, "ids")
    more = rows.take(pa.array(np.arange(count) % rows.num_rows))
    number = more.schema.get_field_index("artifact")
    ids = pa.array([draws.bytes(16).hex() for _ in range(count)])
    more = more.set_column(number, more.schema.field(number), ids)
    info = {"message": "clips", "branch": "main", "commit": "c0123456789abcdef"}
    lake.catalog.append(more, base=lake.catalog.head(), info=info)
    assert set(rows["frame_count"].to_pylist()) == {CLIP_FRAMES}


def _fresh(lake: str, environment: dict[str, str], *, before: str = "") -> dict[str, Any]:
    return json.loads(_python(before + _FRESH, environment, lake, str(BATCH)).splitlines()[-1])


def _python(program: str, environment: dict[str, str], *arguments: str) -> str:
    own = {name: value for name, value in os.environ.items() if not name.startswith("AWS_")}
    done = subprocess.run(
        [sys.executable, "-c", program, *arguments],
        check=True,
        stdout=subprocess.PIPE,
        text=True,
        env={**own, **environment},
    )
    return done.stdout
