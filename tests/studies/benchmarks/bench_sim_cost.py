"""What the simulator's time and memory grow with, and how far a step is from the limits of the
core.

One core, float32, the compiled kernel, flags in 4 m/s, contact off; processor time, the least of
several runs. The exponents are slopes of log time (for a whole batch) against log size: 1 where the
cost is linear. The limits of the core are measured in the same run by a small program of the
kernel's compiler: independent fused multiply-adds in registers at the full width of its vectors,
and copying between arrays larger than all caches.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import torch

from sim.cloth.material import named_material
from sim.cloth.scene import assemble, flag
from sim.cloth.state import State
from sim.cloth.system import System
from sim.compiler import compiler
from sim.integrate import Backend, advance, stable_step

BATCH = 16
STEPS = 60
COLUMNS = (15, 30, 60, 90)
STEP_COUNTS = (30, 60, 120, 240, 480)
BATCHES = (16, 32, 64, 128, 256)
MEMORY = ((30, 16), (30, 256), (60, 16), (60, 256))
# Vector operations a face and a hinge, read off the kernel's source; additions, multiplications and
# fused ones alike.
FACE_OPERATIONS, HINGE_OPERATIONS = 200, 180
# Positions and velocities, read and written, and forces, written and read: 6 × 3 × 4 B a vertex and
# member.
STATE_BYTES = 72


def run(*, seed: int, out: Path) -> dict[str, Any]:
    """Times [µs], memory [MB] and limits; the scenes are fixed, so that `seed` and `out` change
    nothing."""
    threads = torch.get_num_threads()
    torch.set_num_threads(1)
    allowed = os.sched_getaffinity(0) if hasattr(os, "sched_getaffinity") else set()
    if allowed:
        os.sched_setaffinity(0, {max(allowed)})
    try:
        with torch.no_grad():
            limits = _limits()
            result = {
                "dtype": "float32",
                "limits_of_the_core": limits,
                "against_vertices": _against([_timed(columns=n) for n in COLUMNS], "vertices"),
                "against_steps": _against([_timed(steps=n) for n in STEP_COUNTS], "steps"),
                "against_batch": _against([_timed(batch=n) for n in BATCHES], "batch"),
                "share_of_the_limits": [_share(columns, limits) for columns in (30, 60)],
            }
    finally:
        torch.set_num_threads(threads)
        if allowed:
            os.sched_setaffinity(0, allowed)
    result["memory"] = [_memory(columns, batch) for columns, batch in MEMORY]
    return result


def _made(columns: int, batch: int) -> tuple[System, State, float]:
    """A batch on its way, and a step that is stable for it [s]."""
    system, state = assemble(
        [flag(material=named_material("camel-ponte-roma"), wind_speed=4.0, columns=columns)] * batch
    )
    step = 0.7 * stable_step(system)
    return system, advance(system, state, STEPS * step, steps=STEPS, backend=Backend.KERNEL), step


def _timed(*, columns: int = 30, steps: int = STEPS, batch: int = BATCH) -> dict[str, float]:
    system, state, step = _made(columns, batch)
    seconds = _least(
        lambda: advance(system, state, steps * step, steps=steps, backend=Backend.KERNEL), 9
    )
    vertices = system.cloth.mesh.vertex_count
    return {
        "vertices": vertices,
        "steps": steps,
        "batch": batch,
        "ms": 1e3 * seconds,
        "ns_a_vertex_step_member": 1e9 * seconds / (vertices * (steps + 1) * batch),
    }


def _against(rows: Sequence[dict[str, float]], name: str) -> dict[str, Any]:
    # A frame of n steps evaluates the forces n + 1 times.
    sizes = [row[name] + (name == "steps") for row in rows]
    slope = np.polyfit(np.log(sizes), np.log([row["ms"] for row in rows]), 1)[0]
    return {"exponent": float(slope), "rows": list(rows)}


_PROBE = r"""
#include <cstdio>
#include <cstring>
#include <ctime>
#include <vector>
typedef float Wide __attribute__((vector_size(64)));
static double now() { timespec t; clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t); return t.tv_sec + 1e-9 * t.tv_nsec; }
int main() {
  double operations = 0, bytes = 0;
  for (int repeat = 0; repeat < 9; ++repeat) {
    Wide sum[12];
    for (int i = 0; i < 12; ++i) sum[i] = Wide{} + (1.0f + i);
    const Wide factor = Wide{} + 0.999f, term = Wide{} + 0.001f;
    const long rounds = 4000000;
    double start = now();
    for (long n = 0; n < rounds; ++n) {
      for (int i = 0; i < 12; ++i) { sum[i] = sum[i] * factor + term; asm volatile("" : "+x"(sum[i])); }
    }
    const double rate = 12.0 * 16 * rounds / (now() - start);
    if (rate > operations) operations = rate;
  }
  std::vector<char> from(1 << 28, 1), to(1 << 28, 2);
  for (int repeat = 0; repeat < 9; ++repeat) {
    const double start = now();
    memcpy(to.data(), from.data(), from.size());
    const double rate = 2.0 * from.size() / (now() - start);
    if (rate > bytes) bytes = rate;
    asm volatile("" : : "r"(to.data()) : "memory");
  }
  printf("%.6e %.6e\n", operations, bytes);
}
"""


def _limits() -> dict[str, float]:
    """Multiply-adds and bytes a second of the core that runs this."""
    path = compiler()
    if path is None:
        raise RuntimeError("no C++ compiler: this benchmark is of the compiled kernel")
    with tempfile.TemporaryDirectory() as folder:
        source, program = Path(folder) / "probe.cpp", Path(folder) / "probe"
        source.write_text(_PROBE)
        subprocess.run([path, "-O3", "-march=native", "-o", str(program), str(source)], check=True)
        done = subprocess.run([str(program)], capture_output=True, check=True, text=True)
    operations, size = (float(word) for word in done.stdout.split())
    return {"multiply_adds_per_second": operations, "memory_bytes_per_second": size}


def _share(columns: int, limits: dict[str, float]) -> dict[str, float]:
    """A step's time against what its arithmetic and its traffic would take at the limits [µs a
    flag]."""
    system, state, step = _made(columns, BATCH)
    seconds = _least(
        lambda: advance(system, state, STEPS * step, steps=STEPS, backend=Backend.KERNEL), 9
    )
    measured = 1e6 * seconds / BATCH / (STEPS + 1)
    mesh = system.cloth.mesh
    operations = FACE_OPERATIONS * len(mesh.faces) + HINGE_OPERATIONS * len(system.cloth.hinges)
    arithmetic = 1e6 * operations / limits["multiply_adds_per_second"]
    traffic = 1e6 * STATE_BYTES * mesh.vertex_count / limits["memory_bytes_per_second"]
    return {
        "vertices": mesh.vertex_count,
        "us_a_flag_step": measured,
        "arithmetic_limit_us": arithmetic,
        "memory_limit_us": traffic,
        "arithmetic_share": arithmetic / measured,
        "memory_share": traffic / measured,
        "state_kb_of_16_flags": STATE_BYTES / 2 * mesh.vertex_count * BATCH / 1e3,
    }


_MEASURE = """
import json, sys
import torch
from sim.integrate.symplectic import Symplectic, Backend
from sim.cloth.material import named
from sim.cloth.scene import assemble, flag
columns, batch = int(sys.argv[1]), int(sys.argv[2])
torch.set_num_threads(1)
def peak():
    lines = open("/proc/self/status").read().splitlines()
    return next(int(line.split()[1]) for line in lines if line.startswith("VmHWM:")) / 1024
with torch.no_grad():
    method = Symplectic(backend=Backend.KERNEL)
    system, state = assemble([flag(material=named("camel-ponte-roma"), wind_speed=4.0, columns=3)])
    method.advance(system, state, 1e-3)
    before = peak()
    system, state = assemble([flag(material=named("camel-ponte-roma"), wind_speed=4.0, columns=columns)] * batch)
    method.advance(system, state, 0.04)
    print(json.dumps({"vertices": system.cloth.mesh.vertex_count, "batch": batch, "peak_mb": peak(),
                      "of_it_program_mb": before}))
"""


def _memory(columns: int, batch: int) -> dict[str, float]:
    """Largest resident memory of a process that simulates one frame [MB], and what of it the
    program itself takes."""
    done = subprocess.run(
        [sys.executable, "-c", _MEASURE, str(columns), str(batch)],
        capture_output=True,
        check=True,
        text=True,
        cwd=Path(__file__).parents[3],
    )
    row: dict[str, float] = json.loads(done.stdout)
    return {**row, "kb_a_flag": 1024 * (row["peak_mb"] - row["of_it_program_mb"]) / batch}


def _least(work: Callable[[], object], repeats: int) -> float:
    """Processor time of the quickest run [s]: what other programs do meanwhile adds to the
    others."""
    times = []
    for _ in range(repeats):
        start = time.process_time()
        work()
        times.append(time.process_time() - start)
    return min(times)
