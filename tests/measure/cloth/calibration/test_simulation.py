"""Flags simulated in a log's wind, read as a place sees them, and kept."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from flagdata.core.arrays import FloatArray
from measure.cloth import (
    OBSERVED,
    TABLES,
    Design,
    Flag,
    FlagBatch,
    Log,
    mean_bending,
    simulated_values,
)
from measure.cloth.flag_simulation import cloth
from sim.cloth.material import named_material
from sim.integrate import BackwardEuler, Symplectic

_LOG = Log(times=np.arange(-10.0, 20.0), speed=np.full(30, 5.0), distance=0.0)


def _batch(weights: list[float]) -> FlagBatch:
    count = len(weights)
    fixed = {
        "bending": 4e-5,
        "damping": 8e-3,
        "stretching": 1.0,
        "gain": 1.0,
        "scale": 1.0,
        "eddies": 60.0,
        "distance_constant": 0.0,
        "fabric": 0.5,
    }
    return FlagBatch(
        flag=Flag(length=1.5, height=1.0),
        log=_LOG,
        duration=5.0,
        columns=8,
        seeds=tuple(range(count)),
        values={
            "area_weight": np.array(weights),
            **{name: np.full(count, value) for name, value in fixed.items()},
        },
        places=np.tile([math.radians(80), 0.0, 15.0], (count, 1, 1)),
    )


def test_a_heavier_flag_droops_more_and_repeats() -> None:
    found = _batch([0.08, 0.35]).read()
    assert found.shape == (2, 1, 2, len(OBSERVED))
    light, heavy = found[:, 0, :, OBSERVED.index("droop")].mean(axis=1)
    assert heavy > light + 0.1
    assert np.array_equal(found, _batch([0.08, 0.35]).read(), equal_nan=True)


def test_a_cloth_has_the_bending_it_is_given() -> None:
    made = cloth(0.2, 7e-5, 0.01, stretching=2.0, fabric="gray-interlock")
    assert mean_bending(made) == pytest.approx(7e-5)
    assert made.area_weight == 0.2
    assert np.allclose(made.stretching, 2 * named_material("gray-interlock").stretching)


def test_simulations_draw_their_fabrics() -> None:
    design = Design(flag=Flag(length=1.5, height=1.0), log=_LOG, duration=5.0, count=32, seed=1)
    scenes = [
        one for batch in design.batches() for one in batch._scenes(design.flag.mesh(4), damped=0.0)
    ]
    drawn = [scene.material.name for scene in scenes]
    assert {drawn.count(name) for name in TABLES} <= {
        2,
        3,
        4,
        5,
    }  # of 32 each of ten evenly: a Sobol sequence


def test_recordings_of_a_flag_are_simulated_with_the_same_cloths_in_places_of_their_own() -> None:
    one, other = (
        Design(
            flag=Flag(length=1.5, height=1.0),
            log=log,
            duration=5.0,
            count=32,
            seed=1,
            recording=name,
            place=name,
        )
        for name, log in (("one", _LOG), ("other", replace(_LOG, distance=None, clock=0.1)))
    )
    first, second = one.values(), other.values()
    for name in ("area_weight", "bending", "damping", "stretching", "fabric"):
        assert np.array_equal(first[name], second[name])
    for name in ("gain", "scale", "eddies", "azimuth", "elevation"):
        assert abs(np.corrcoef(first[name], second[name])[0, 1]) < 0.5
    seeds = [seed for design in (one, other) for batch in design.batches() for seed in batch.seeds]
    assert len(set(seeds)) == 64


def test_no_integrator_damps_more_than_its_cloths() -> None:
    """Backward Euler damps by its step, so that a damping below its shortest one takes leapfrog."""
    flags = _batch([0.1, 0.2])
    cases = (
        (3e-4, Symplectic, 3e-4),
        (1.5e-3, BackwardEuler, 0.5e-3),
        (2e-2, BackwardEuler, 16e-3),
    )
    for damping, kind, material in cases:
        damped = replace(flags, values={**flags.values, "damping": np.full(2, damping)})
        system, _, integrator = damped._assemble_flags(flags.flag.mesh(4))
        assert isinstance(integrator, kind)
        assert np.allclose(system.cloth.damping.numpy(), material, rtol=1e-5)


def test_a_clock_moves_the_wind() -> None:
    ramp = replace(
        _batch([0.2]), log=Log(times=_LOG.times, speed=5 + 0.1 * _LOG.times, distance=0.0)
    )
    early = replace(ramp, values={**ramp.values, "clock_error": np.array([-2.0])})
    mesh = ramp.flag.mesh(4)
    before, after = (
        one._wind(one._assemble_flags(mesh)[0]).samples[:, 0].mean().item() for one in (ramp, early)
    )
    assert after - before == pytest.approx(0.2, abs=0.05)  # 0.1 m/s a second, for two seconds


def test_kept_simulations_are_not_made_anew(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    made: list[int] = []

    def read(batch: FlagBatch) -> FloatArray:
        made.append(len(batch.seeds))
        return batch.values["area_weight"][:, None, None, None] * np.ones((1, 1, 2, len(OBSERVED)))

    monkeypatch.setattr(FlagBatch, "read", read)
    design = Design(flag=Flag(length=1.5, height=1.0), log=_LOG, duration=5.0, count=24, seed=1)
    steps: list[int] = []
    first = simulated_values(design, folder=tmp_path, advance=steps.append)
    assert made == [16, 8]
    assert steps == [16 * 5, 8 * 5]  # seconds of flags
    assert np.array_equal(first[:, 0, 0], design.values()["area_weight"])
    (path, *_) = sorted(tmp_path.glob("*.npz"))
    path.unlink()  # interrupted before the last batch
    again = simulated_values(design, folder=tmp_path, advance=steps.append)
    assert len(made) == 3
    assert sum(steps) == 2 * 24 * 5
    assert np.array_equal(again, first)
    simulated_values(replace(design, seed=2), folder=tmp_path)
    assert len(made) == 5
