"""Speed of the Warp kernel on a graphics processor, with the distance to the compiled kernel beside
it.

Apart from `make bench`, which runs where there is none: `python -m tests.studies sim-gpu --out
docs/results`. Flags of 651 vertices in 4.0 to 5.5 m/s, float32, contact off, 40 ms frames. The peer
is the compiled kernel on one core and on all of them. Beside it, steps of training a second of the
network `flow`, on inputs of random numbers.
"""

from __future__ import annotations

import os
import statistics
import time
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from importlib.metadata import version
from pathlib import Path
from typing import Any

import torch

from models.maps.frontend import FrontEnd
from models.networks.learner import Loss, build
from sim.cloth.material import named_material
from sim.cloth.scene import assemble, flag
from sim.cloth.state import State
from sim.cloth.system import System
from sim.integrate import Backend, Symplectic, advance
from sim.kernel_warp import leapfrog

FRAME = 0.04
FLAGS = (256, 1024, 4096, 16384, 65536)
BATCHES = (32, 64, 128, 256)
LOOKED_AT = (1, 5, 10, 15, 20, 25)  # frames
VARIANTS = (  # threads of a block, blocks of a multiprocessor, approximate divisions and roots
    (192, 3, True),
    (256, 3, True),
    (320, 2, True),
    (320, 3, True),
    (416, 2, True),
    (512, 2, True),
    (256, 3, False),
    (416, 2, False),
)
_DISTINCT = 256


def run(
    *, seed: int, out: Path, device: str = "cuda", flags: Sequence[int] = FLAGS, columns: int = 30
) -> dict[str, Any]:
    """Flag-frames a second by batch, by variant, agreement, memory, steps of training a second.

    Args:
        seed, out: change nothing; the scenes are fixed.
    """
    torch.set_num_threads(1)
    result: dict[str, Any] = {"device": _named(device), "frame_s": FRAME, "vertices": None}
    with torch.no_grad():
        scenes = [
            flag(
                material=named_material("camel-ponte-roma"),
                wind_speed=4.0 + 1.5 * i / _DISTINCT,
                columns=columns,
            )
            for i in range(_DISTINCT)
        ]
        few, start = assemble(scenes[:: _DISTINCT // 16])
        steps = Symplectic().steps(few, FRAME)
        result |= {"vertices": few.cloth.mesh.vertex_count, "steps_a_frame": steps}
        result["compiled_kernel"] = _compiled(few, start, steps)
        _say(result)
        result["agreement"] = {
            "fine_mesh": _agreement(device, columns),
            "coarse_mesh": _agreement(device, 6),
        }
        _say(result["agreement"])

        system, state = assemble(scenes, device=device)
        for _ in range(10):
            state = advance(system, state, FRAME, steps=steps, backend=Backend.WARP)

        def rate(count: int) -> dict[str, Any]:
            return _rate(scenes, state, steps, count, device)

        result["variants"] = []
        for threads, blocks, fast in VARIANTS:
            _choose(threads, blocks, fast)
            found = rate(flags[min(2, len(flags) - 1)])
            result["variants"].append(
                {"threads": threads, "blocks": blocks, "fast_math": fast, **found}
            )
            _say(result["variants"][-1])
        result["rates"] = {}
        for fast in (False, True):
            able = [each for each in result["variants"] if each["fast_math"] is fast]
            best = max(able, key=lambda each: each["flag_frames_a_second"])
            _choose(best["threads"], best["blocks"], fast)
            rows = [rate(count) for count in flags]
            kind = "approximate" if fast else "ieee"
            result["rates"][kind] = {
                "threads": best["threads"],
                "blocks": best["blocks"],
                "by_flags": rows,
            }
            _say(result["rates"][kind])
    result["training_of_flow"] = [_training(batch, device) for batch in BATCHES]
    return result


def _say(part: object) -> None:
    print(part, flush=True)  # noqa: T201


def _choose(threads: int, blocks: int, fast: bool) -> None:
    """What the kernel is compiled with from now on."""
    leapfrog.THREADS, leapfrog.BLOCKS, leapfrog.OPTIONS = threads, blocks, {"fast_math": fast}
    leapfrog.kernel.cache_clear()


def _named(device: str) -> dict[str, Any]:
    if not device.startswith("cuda"):
        return {"name": device}
    found = torch.cuda.get_device_properties(device)
    return {
        "name": found.name,
        "memory_gib": round(found.total_memory / 2**30, 1),
        "multiprocessors": found.multi_processor_count,
        "cuda_of_torch": torch.version.cuda,
        "warp": version("warp-lang"),
    }


def _wait(device: str) -> None:
    if device.startswith("cuda"):
        torch.cuda.synchronize()


def _seconds(work: Callable[[], object], device: str, *, repeats: int = 5) -> float:
    """Median; once before, unmeasured."""
    times = []
    for index in range(repeats + 1):
        _wait(device)
        begun = time.perf_counter()
        work()
        _wait(device)
        if index:
            times.append(time.perf_counter() - begun)
    return statistics.median(times)


def _compiled(system: System, start: State, steps: int) -> dict[str, float]:
    """The C++ kernel: batches of 16, on one core and on all."""
    state = start
    for _ in range(10):
        state = advance(system, state, FRAME, steps=steps, backend=Backend.KERNEL)

    def frame(_: int) -> State:
        return advance(system, state, FRAME, steps=steps, backend=Backend.KERNEL)

    alone = _seconds(lambda: frame(0), "cpu") / system.cloth.batch
    cores = len(os.sched_getaffinity(0))
    with ThreadPoolExecutor(cores) as pool:
        together = (
            _seconds(lambda: list(pool.map(frame, range(4 * cores))), "cpu")
            / system.cloth.batch
            / 4
            / cores
        )
    return {
        "cores": cores,
        "flag_frames_a_second_on_one_core": round(1 / alone, 1),
        "flag_frames_a_second_on_all": round(1 / together, 1),
    }


def _rate(
    scenes: Sequence[Any], state: State, steps: int, count: int, device: str
) -> dict[str, Any]:
    system, _ = assemble([scenes[i % _DISTINCT] for i in range(count)], device=device)
    repeats = max(1, count // _DISTINCT)
    many = State(
        position=state.position.repeat(1, 1, repeats)[..., :count],
        velocity=state.velocity.repeat(1, 1, repeats)[..., :count],
    )
    if device.startswith("cuda"):
        torch.cuda.reset_peak_memory_stats()
    seconds = _seconds(
        lambda: advance(system, many, FRAME, steps=steps, backend=Backend.WARP), device
    )
    after = advance(system, many, FRAME, steps=steps, backend=Backend.WARP)
    return {
        "flags": count,
        "flag_frames_a_second": round(count / seconds),
        "healthy": round(float(after.healthy().float().mean()), 4),
        "peak_memory_mib": round(torch.cuda.max_memory_allocated() / 2**20)
        if device.startswith("cuda")
        else None,
    }


def _agreement(device: str, columns: int) -> dict[str, Any]:
    """Largest distance of a vertex from where the compiled kernel has it, float32, and float64 of
    the latter [m]."""
    scenes = [
        flag(material=named_material("camel-ponte-roma"), wind_speed=speed, columns=columns)
        for speed in (1.0, 2.0, 3.0)
    ]
    ways = {
        "compiled": ("cpu", torch.float32, Backend.KERNEL),
        "compiled_float64": ("cpu", torch.float64, Backend.KERNEL),
        "warp": (device, torch.float32, Backend.WARP),
    }
    shapes = {}
    steps = Symplectic().steps(assemble(scenes)[0], FRAME)
    for name, (where, dtype, backend) in ways.items():
        system, state = assemble(scenes, dtype=dtype, device=where)
        shapes[name] = []
        for _ in range(max(LOOKED_AT)):
            state = advance(system, state, FRAME, steps=steps, backend=backend)
            shapes[name].append(state.position.to("cpu", torch.float64))
    return {
        name: {
            f"after_{round(1e3 * FRAME * frame)}_ms": float(
                (shapes[name][frame - 1] - shapes["compiled"][frame - 1]).norm(dim=1).max()
            )
            for frame in LOOKED_AT
        }
        for name in ("warp", "compiled_float64")
    }


def _training(batch: int, device: str) -> dict[str, Any]:
    """Forward, backward and a step of Adam."""
    targets = (
        "wind_speed",
        "fabric_area_weight",
        "fabric_bending",
        "anisotropy",
    )  # as catalogs/training/flow.toml has it
    learner = build(
        "flow", {"dimension": 32}, loss=Loss.POSTERIOR, targets=targets, components=6, margin=1.0
    ).to(device)
    optimiser = torch.optim.Adam(learner.parameters())
    inputs = torch.randn((batch, *FrontEnd(maps="flow-maps", size=112).shape), device=device)
    values = torch.full((batch, len(targets)), 5.0, device=device)
    sequence = torch.arange(batch, device=device)

    def step() -> None:
        optimiser.zero_grad(set_to_none=True)
        learner.loss(inputs, values, sequence).backward()
        optimiser.step()

    seconds = _seconds(step, device, repeats=20)
    return {
        "batch": batch,
        "steps_a_second": round(1 / seconds, 1),
        "clips_a_second": round(batch / seconds),
    }
