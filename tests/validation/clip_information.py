"""How well could wind and area weight be told from a clip at best? From the true motion, with nothing to be seen.

Markers on each simulated flag are followed without error: in space, or in the picture of the camera that filmed them.
Simple statistics of their motion go to gradient boosting, trained on the training side's flags and tested on the test
side's. Its error is an upper bound of what is lost by the cloth's own irregularity, by the projection and by the clip's
length; what a network errs beyond it is lost between the pixels and the motion.

It reads the lake that FLAGDATA_WIDE names, with `flagsim-wide` in it.
"""

from __future__ import annotations

import json
import os
from pathlib import Path
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from sklearn.ensemble import HistGradientBoostingRegressor

from flagdata.lake import Lake
from flagdata.lake.meshes import MeshSequence, read_meshes
from measure.refine.view import of_parameters
from sim.render import Meshes
from sim.render.stage import stage

NAME = "flagsim-wide"
ACROSS, DOWN = 9, 5  # markers
WITHIN = 0.5  # m/s, the paper's accuracy


def run(*, seed: int, out: Path) -> dict[str, Any]:
    """Errors by what is followed and for how long."""
    del out
    place = os.environ.get("FLAGDATA_WIDE")
    if place is None:
        return {"left_out": f"no data set; set FLAGDATA_WIDE to a lake with {NAME}"}
    space, picture, truth, test = _followed(Lake.open(place))
    cases = {
        "in space, 50 frames": space, "in space, 30 frames": space[:, :30], "in the picture, 50 frames": picture,
        "in the picture, 30 frames": picture[:, :30],
    }  # fmt: skip
    result: dict[str, Any] = {"films": {"train": int((~test).sum()), "test": int(test.sum())}, "of": {}}
    for name, motion in cases.items():
        features = np.concatenate(list(statistics(motion).values()), axis=1)
        result["of"][name] = {
            target: _errors(features, truth[:, column], test, seed)
            for column, target in enumerate(("wind_speed", "density"))
        }
    for name, values in statistics(picture[:, :30]).items():
        result["of"][f"in the picture, 30 frames, {name} alone"] = {
            "wind_speed": _errors(values, truth[:, 0], test, seed)
        }
    return result


def statistics(motion: NDArray[np.float32]) -> dict[str, NDArray[np.float64]]:
    """Of markers (n, frames, marker, axis): name → (n, k)."""
    x = motion.astype(np.float64)
    count = x.shape[1]
    mean = x.mean(axis=1)
    step = np.diff(x, axis=1)
    turn = np.diff(step, axis=1)
    spectrum = np.abs(np.fft.rfft((x - mean[:, None]) * np.hanning(count)[None, :, None, None], axis=1)) ** 2
    bins = np.arange(spectrum.shape[1])[None, :, None, None]
    kept = {
        "mean place": mean,
        "deviation": np.log(x.std(axis=1) + 1e-4),
        "speed": np.log((step**2).mean(axis=1) + 1e-8),
        "acceleration": np.log((turn**2).mean(axis=1) + 1e-8),
        "centre of the spectrum": (spectrum * bins).sum(axis=1) / (spectrum.sum(axis=1) + 1e-12),
        "spectrum of all": np.log(spectrum.sum(axis=2) + 1e-7),
    }
    return {name: values.reshape(len(x), -1) for name, values in kept.items()}


def _errors(features: NDArray[np.float64], wanted: NDArray[np.float64], test: NDArray[np.bool_], seed: int) -> Any:
    machine = HistGradientBoostingRegressor(
        max_iter=400, learning_rate=0.05, l2_regularization=1.0, max_features=0.5, random_state=seed
    )
    error = machine.fit(features[~test], wanted[~test]).predict(features[test]) - wanted[test]
    return {
        "rmse": float(np.sqrt(np.mean(error**2))),
        "spread": float(wanted[test].std()),
        "within_half": float(np.mean(np.abs(error) < WITHIN)),
    }


def _followed(lake: Lake) -> tuple[NDArray[np.float32], NDArray[np.float32], NDArray[np.float64], NDArray[np.bool_]]:
    """(n, 50, marker, 3) [m], (n, 50, marker, 2) in picture widths, (n, 2) wind and weight, (n,) whether tested."""
    objects = {row["artifact"]: row["object"] for row in lake.rows("kind = 'meshes'").to_pylist()}
    space, picture, truth, test = [], [], [], []
    for row in lake.rows("kind = 'recording'").to_pylist():
        if not row["name"].startswith((f"{NAME}-train", f"{NAME}-test")):
            continue
        parameters = json.loads(row["parameters"])
        sequence = read_meshes(lake.object_path(objects[row["parents"][0]]))
        assert isinstance(sequence, MeshSequence)
        marked = sequence.positions[:, _markers(sequence)]
        view = of_parameters(parameters, where=row["name"])
        assert view is not None
        placed = stage(Meshes.flag(sequence, heading=0.0), view.zeta)
        points = torch.from_numpy(marked).double() + torch.tensor(placed.shift, dtype=torch.float64)
        places, _ = placed.camera.project(points)
        space.append(marked)
        picture.append((places / view.zeta.width).float().numpy())
        truth.append((parameters["wind_speed"], parameters["density"]))
        test.append(row["name"].startswith(f"{NAME}-test"))
    return np.stack(space), np.stack(picture), np.array(truth), np.array(test)


def _markers(sequence: MeshSequence) -> NDArray[np.int64]:
    """Vertices nearest to a grid over the cloth."""
    width, height = sequence.rest.max(axis=0)
    grid = np.stack(np.meshgrid(np.linspace(0, width, ACROSS), np.linspace(0, height, DOWN)), axis=-1).reshape(-1, 2)
    return np.array([((sequence.rest - place) ** 2).sum(axis=1).argmin() for place in grid])
