"""A gate beside its model: one file of tensors, bound to the network that it was calibrated for."""

from __future__ import annotations

import hashlib
from pathlib import Path

import numpy as np
import torch

from flagdata.core.arrays import UInt8Array
from flagdata.errors import CorruptError
from measure.gate.gate import SCORES, Gate
from measure.gate.tail_probability import ExponentialTails
from models.trained.estimator import Estimator
from models.trained.model_folder import read_tensors, renew, tensor_bytes

GATE = "gate.safetensors"
"""Name of the file in a model's folder."""
_DIRECT = ("centre", "scale", "whitening", "directions", "offsets", "calibration", "statistics")


def fingerprint(model: Estimator) -> UInt8Array:
    """Hashes the weights of the learner whose summaries the gate looks at: SHA-256, (32,)."""
    digest = hashlib.sha256()
    for name, value in sorted(model.learners[0].state_dict().items()):
        digest.update(name.encode())
        digest.update(value.detach().cpu().contiguous().numpy().tobytes())
    return np.frombuffer(digest.digest(), dtype=np.uint8)


def write(folder: Path, gate: Gate, model: Estimator) -> Path:
    """Store a gate in the folder of the model that it was calibrated for.

    Its largest arrays, `whitening` and `directions`, are stored in single precision: distances keep
    seven digits, and the file is half as large.
    """
    tensors = {
        name: torch.from_numpy(np.ascontiguousarray(getattr(gate, name))) for name in _DIRECT
    }
    tensors |= {
        "tail_start": torch.from_numpy(gate.tails.start),
        "tail_excess": torch.from_numpy(gate.tails.excess),
    }
    tensors["network"] = torch.from_numpy(fingerprint(model).copy())
    tensors |= {name: tensors[name].float() for name in ("whitening", "directions")}
    renew(folder, GATE, tensor_bytes(tensors))
    return folder / GATE


def read(folder: Path, model: Estimator) -> Gate:
    """Reads the gate in a model's folder.

    Raises:
        NotFoundError: there is none.
        CorruptError: it is damaged, of another version, or was calibrated for another network.
    """
    path = folder / GATE
    arrays = {name: value.numpy() for name, value in read_tensors(path).items()}
    again = "calibrate it anew, in a checkout of flagdata: python -m tests.studies gate"
    missing = {*_DIRECT, "tail_start", "tail_excess", "network"} - arrays.keys()
    if missing or len(arrays["tail_start"]) != len(SCORES):
        raise CorruptError("the gate does not fit this version", where=str(path), fix=again)
    if not np.array_equal(arrays["network"], fingerprint(model)):
        raise CorruptError(
            "the gate was calibrated for another network", where=str(path), fix=again
        )
    return Gate(
        **{name: arrays[name].astype(np.float64) for name in _DIRECT},
        tails=ExponentialTails(start=arrays["tail_start"], excess=arrays["tail_excess"]),
    )
