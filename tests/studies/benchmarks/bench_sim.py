"""Speed of the simulator on one core, with the distance to the reference run beside it.

Float32, batch 16, tables and damping included, from flags in 4.0 to 5.5 m/s; contact off, and by
itself. The peer is ArcSim 0.2.1 on the same mesh, material and wind, by the wall times stored with
its runs (another run of this machine class).
"""

from __future__ import annotations

import os
import platform
import resource
import statistics
import time
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import torch

from sim.cloth.contact import Contact
from sim.cloth.limits import StrainLimits
from sim.cloth.material import named_material
from sim.cloth.scene import assemble, flag
from sim.cloth.state import State
from sim.cloth.system import System
from sim.integrate import Backend, BackwardEuler, Symplectic, advance, stable_step
from sim.kernel import Kernel
from tests.evidence import REFERENCE

FRAME = 0.04
BATCH = 16
# Frames a flag of ArcSim, ms, measured on this machine class: at 0.5 ms and at its own 5 ms steps.
PEER = {651: (550.0, 50.0), 2501: (3700.0, 370.0)}

# Where contact is timed: calm flags hang in folds, flapping ones touch here and there.
WINDS = {"calm": (0.2, 1.0), "flapping": (4.0, 5.5)}


def run(*, seed: int, out: Path) -> dict[str, Any]:
    """Times of one 40 ms frame a flag [ms]; the scenes are fixed, so that `seed` and `out` change
    nothing."""
    torch.set_num_threads(1)
    result: dict[str, Any] = {
        "batch": BATCH,
        "dtype": "float32",
        "machine": platform.machine(),
        "meshes": [],
    }
    if hasattr(os, "sched_setaffinity"):
        allowed = os.sched_getaffinity(0)
        os.sched_setaffinity(0, {max(allowed)})
    try:
        with torch.no_grad():
            for columns in (30, 60):
                result["meshes"].append(_mesh(columns))
            result["linear_in_batch"] = _batches()
            result["accuracy"] = _accuracy()
    finally:
        if hasattr(os, "sched_setaffinity"):
            os.sched_setaffinity(0, allowed)
    result["peak_memory_mb"] = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    return result


def _mesh(columns: int) -> dict[str, Any]:
    scenes = [
        flag(material=named_material("camel-ponte-roma"), wind_speed=4.0 + 0.1 * b, columns=columns)
        for b in range(BATCH)
    ]
    system, state = assemble(scenes)
    steps = Symplectic().steps(system, FRAME)
    for _ in range(10):
        state = advance(system, state, FRAME, steps=steps, backend=Backend.KERNEL)
    frame = (
        _median(lambda: advance(system, state, FRAME, steps=steps, backend=Backend.KERNEL), 7)
        / BATCH
    )
    vertices = system.cloth.mesh.vertex_count
    fine, coarse = PEER[vertices]
    report = {
        "vertices": vertices,
        "stability_limit_ms": 1e3 * stable_step(system),
        "steps_a_frame": steps,
        "ms_a_flag_frame": 1e3 * frame,
        "us_a_flag_step": 1e6 * frame / (steps + 1),
        "ns_a_vertex_step": 1e9 * frame / (steps + 1) / vertices,
        "times_arcsim_at_half_millisecond": fine / (1e3 * frame),
        "times_arcsim_at_its_5_ms": coarse / (1e3 * frame),
        "torch_us_a_flag_step": 1e6
        * _median(lambda: advance(system, state, FRAME / steps, steps=1, backend=Backend.TORCH), 3)
        / BATCH
        / 2,
    }
    implicit = BackwardEuler(tolerance=1e-4)
    report["implicit_5_ms_ms_a_flag_frame"] = (
        1e3 * _median(lambda: implicit.advance(system, state, FRAME), 3) / BATCH
    )
    report["profile"] = _profile(system, state, steps)
    if columns == 30:
        limited = replace(system, limits=StrainLimits())
        count = Symplectic().steps(limited, FRAME)
        seconds = _median(
            lambda: advance(limited, state, FRAME, steps=count, backend=Backend.KERNEL), 7
        )
        report["ms_a_flag_frame_with_strain_limits"] = 1e3 * seconds / BATCH
        report["steps_a_frame_with_strain_limits"] = count
    report["contact"] = [_contact(columns, name, *winds) for name, winds in WINDS.items()]
    return report


def _contact(columns: int, name: str, low: float, high: float) -> dict[str, Any]:
    """What contact costs after a second in winds of a range [m/s]: over a frame, and over equally
    many steps."""
    speeds = np.linspace(low, high, BATCH).tolist()
    scenes = [
        flag(material=named_material("camel-ponte-roma"), wind_speed=speed, columns=columns)
        for speed in speeds
    ]
    system, state = assemble(scenes)
    touching = replace(system, contact=Contact())
    fewer, steps = Symplectic().steps(system, FRAME), Symplectic().steps(touching, FRAME)
    for _ in range(25):
        state = advance(touching, state, FRAME, steps=steps, backend=Backend.KERNEL)

    def seconds(chosen: System, count: int) -> float:
        return _median(
            lambda: advance(chosen, state, FRAME, steps=count, backend=Backend.KERNEL), 5
        )

    without, same, with_contact = (
        seconds(system, fewer),
        seconds(system, steps),
        seconds(touching, steps),
    )
    return {
        "winds": name,
        "steps_a_frame": steps,
        "steps_a_frame_without": fewer,
        "ms_a_flag_frame": 1e3 * with_contact / BATCH,
        "times_without_a_frame": with_contact / without,
        "times_without_a_step": with_contact / same,
    }


def _profile(system: System, state: State, steps: int) -> dict[str, float]:
    """Where a step's time goes, by leaving parts of the kernel's work out [µs a flag].

    The arithmetic bound counts some 200 vector operations a face and 180 a hinge (read off the
    source), two a cycle, on a unit of 16 lanes. Above it: the look-up of the stretching table, some
    400 narrow operations a face for all lanes; divisions and roots; and traffic with the level-2
    cache, since positions, velocities and forces take 36 B a vertex and member.
    """
    kernel = Kernel.of(system)
    assert kernel is not None
    full = (kernel.problem.faces, kernel.problem.hinges)

    def microseconds(faces: int, hinges: int) -> float:
        kernel.problem.faces, kernel.problem.hinges = faces, hinges
        try:
            seconds = _median(
                lambda: kernel.advance(
                    system.drive(0.0, 1e-9), state.position, state.velocity, 1e-12, steps
                ),
                5,
            )
        finally:
            kernel.problem.faces, kernel.problem.hinges = full
        return 1e6 * seconds / BATCH / (steps + 1)

    rest, with_faces, with_hinges = (
        microseconds(0, 0),
        microseconds(full[0], 0),
        microseconds(0, full[1]),
    )
    cycles = (200 * full[0] + 180 * full[1]) / 2 / BATCH
    return {
        "faces_us": with_faces - rest,
        "hinges_us": with_hinges - rest,
        "vertices_us": rest,
        "arithmetic_bound_at_3_ghz_us": cycles / 3e3,
        "state_bytes_a_flag": 36.0 * system.cloth.mesh.vertex_count,
    }


def _batches() -> list[dict[str, float]]:
    """Time of a frame against the batch, with one flag's worth of steps: linear beyond one block of
    16 lanes."""
    rows = []
    for batch in (16, 32, 64):
        system, state = assemble(
            [flag(material=named_material("camel-ponte-roma"), wind_speed=4.0)] * batch
        )
        seconds = _median(
            lambda s=system, x=state: advance(s, x, FRAME, steps=60, backend=Backend.KERNEL), 3
        )
        rows.append({"batch": batch, "us_a_flag_step": 1e6 * seconds / 61 / batch})
    return rows


def _accuracy() -> dict[str, Any]:
    """Mean vertex distance to the reference's 0.5 ms run after 1, 5 and 10 frames [mm], float32, as
    timed."""
    path = REFERENCE / "arcsim" / "flag_w4_dt05.npz"
    if not path.is_file():
        return {"skipped": f"no reference data at {path.name}"}
    with np.load(path) as run_:
        expected, seconds = run_["positions"].astype(np.float64), run_["frame_seconds"]
    system, state = assemble([flag(material=named_material("camel-ponte-roma"), wind_speed=4.0)])
    distance = {}
    for frame in range(1, 11):
        state = Symplectic(backend=Backend.KERNEL).advance(system, state, FRAME)
        if frame in (1, 5, 10):
            gap = state.position[..., 0].double().numpy() - expected[frame]
            distance[f"frame_{frame}_mm"] = 1e3 * float(np.linalg.norm(gap, axis=1).mean())
    return {**distance, "arcsim_ms_a_frame_when_run": 1e3 * float(np.median(seconds))}


def _median(work: Any, repeats: int) -> float:
    times = []
    for _ in range(repeats):
        start = time.perf_counter()
        work()
        times.append(time.perf_counter() - start)
    return statistics.median(times)
