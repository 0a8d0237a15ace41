"""Points of the search space → embeddings, kept on disk: what has been simulated once is never
simulated again.

All optimisers share one evaluator. An embedding depends on the point, the number of the replicate
and the evaluator's identity alone, not on who asked, when, or beside what: an interrupted run is
resumed by running it again.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable
from dataclasses import asdict, dataclass, field
from io import BytesIO
from pathlib import Path

import numpy as np
import torch

from flagdata.core.arrays import FloatArray, UInt8Array, read_arrays
from flagdata.core.files.checksums import is_sealed, seal_bytes
from flagdata.core.files.outputs import rewrite
from flagdata.core.json_values import json_values
from flagdata.core.provenance import canonical, digest
from flagdata.core.rng import child_seed
from flagdata.errors import CorruptError
from measure.refine.simulator import FilmRequest, Simulator
from models.trained.estimator import Estimator

STAGES = ("simulate", "render", "embed")
_DECIMALS = (
    12  # of a point: enough for any optimiser, and none of the last bits of another machine's
)


@dataclass(frozen=True, kw_only=True, eq=False)
class Evaluated:
    """Clips of one point.

    Attributes:
        embedding: (replicate, dimension) float64; NaN where a simulation failed.
        frame: (height, width) uint8, the middle frame of the first replicate; None where that
            failed.
        seconds: by stage, all replicates together, at the time they were made.
    """

    embedding: FloatArray
    frame: UInt8Array | None
    seconds: dict[str, float]


@dataclass(frozen=True)
class Evaluator:
    """Simulates, films and embeds.

    Attributes:
        simulator: makes the films.
        estimator: makes the embeddings: those of all its learners side by side, so that the squared
            distance is the sum of theirs.
        seed: of the replicates.
        folder: where embeddings are kept, in a folder of this evaluator's identity; None keeps them
            in memory alone.
    """

    simulator: Simulator
    estimator: Estimator
    seed: int
    folder: Path | None = None
    model: str = ""
    """A hash of the estimator's weights; see `fingerprint`."""
    _kept: dict[str, Evaluated] = field(default_factory=dict)

    @property
    def identity(self) -> str:
        """A hash of all that shapes an embedding beside the point and the replicate."""
        return digest(
            canonical(
                {"simulator": self.simulator.identity, "model": self.model, "seed": self.seed}
            )
        )

    def evaluate(
        self, points: FloatArray, replicates: int, *, advance: Callable[[int], object] | None = None
    ) -> list[Evaluated]:
        """Evaluates clips of points (n, 17) of [−1, 1]¹⁷, this many of each.

        Args:
            advance: called with the number of clips that were made or found.

        Raises:
            CorruptError: a file of the cache that cannot be read.
        """
        asked = [
            [self._request(point, number) for number in range(replicates)]
            for point in points.tolist()
        ]
        missing = [
            request
            for requests in asked
            for request in requests
            if self._read_cached(request) is None
        ]
        size = self.simulator.batch
        for first in range(0, len(missing), size):
            part = missing[first : first + size]
            for request, evaluated in zip(part, self._simulate_requests(part), strict=True):
                self._keep(request, evaluated)
            if advance is not None:
                advance(len(part))
        if advance is not None:
            advance(sum(len(requests) for requests in asked) - len(missing))
        return [
            _together([self._read_cached(request) for request in requests]) for requests in asked
        ]

    def clip(self, point: FloatArray, replicate: int = 0) -> UInt8Array | None:
        """Simulates all frames (frame, height, width) of one clip again; None where that fails."""
        return self.simulator.films([self._request(point.tolist(), replicate)])[0].clip

    def _request(self, point: Iterable[float], replicate: int) -> FilmRequest:
        rounded = tuple(round(float(value), _DECIMALS) + 0.0 for value in point)
        return FilmRequest(
            point=rounded,
            seed=child_seed(self.seed, "replicate", digest(repr(rounded)), replicate),
            replicate=replicate,
        )

    def _simulate_requests(self, requests: list[FilmRequest]) -> list[Evaluated]:
        films = self.simulator.films(requests)
        clips = [film.clip for film in films if film.clip is not None]
        begun = time.perf_counter()
        embedded = self.embed(np.stack(clips)) if clips else np.zeros((0, 1))
        share = (time.perf_counter() - begun) / max(1, len(clips))
        rows = iter(embedded)
        return [
            Evaluated(
                embedding=np.full((1, embedded.shape[1]), np.nan)
                if film.clip is None
                else next(rows)[None],
                frame=None if film.clip is None else film.clip[len(film.clip) // 2],
                seconds={**film.seconds, "embed": 0.0 if film.clip is None else share},
            )
            for film in films
        ]

    @torch.no_grad()
    def embed(self, clips: UInt8Array) -> FloatArray:
        """Embeds clips (n, frame, height, width) uint8 to (n, dimension), one by one, so that none
        depends on the others."""
        rows = []
        for clip in clips:
            embedded = self.estimator.embeddings(self.estimator.inputs(clip[None]))
            rows.append(torch.cat(embedded, dim=1)[0].double().cpu().numpy())
        return np.stack(rows)

    def _path(self, request: FilmRequest) -> Path | None:
        if self.folder is None:
            return None
        return self.folder / self.identity[:32] / f"{digest(repr(request))[:32]}.npz"

    def _read_cached(self, request: FilmRequest) -> Evaluated | None:
        key, path = repr(request), self._path(request)
        if key not in self._kept and path is not None and path.exists():
            self._kept[key] = _read(path)
        return self._kept.get(key)

    def _keep(self, request: FilmRequest, evaluated: Evaluated) -> None:
        self._kept[repr(request)] = evaluated
        path = self._path(request)
        if path is not None:
            _write(path, evaluated)


def fingerprint(estimator: Estimator) -> str:
    """Hashes an estimator's weights and front end."""
    parts = [
        canonical(
            {"front_end": asdict(estimator.front_end), "cropping": json_values(estimator.cropping)}
        )
    ]
    for learner in estimator.learners:
        for name, value in sorted(learner.state_dict().items()):
            parts.append(f"{name}:{digest(value.cpu().double().numpy().tobytes().hex())}")
    return digest("\n".join(parts))


def _together(evaluated: list[Evaluated | None]) -> Evaluated:
    present = [entry for entry in evaluated if entry is not None]
    width = max(entry.embedding.shape[1] for entry in present)
    rows = [
        entry.embedding if entry.embedding.shape[1] == width else np.full((1, width), np.nan)
        for entry in present
    ]
    seconds = {stage: sum(entry.seconds[stage] for entry in present) for stage in STAGES}
    return Evaluated(embedding=np.concatenate(rows), frame=present[0].frame, seconds=seconds)


def _write(path: Path, evaluated: Evaluated) -> None:
    frame = np.zeros((0, 0), np.uint8) if evaluated.frame is None else evaluated.frame
    buffer = BytesIO()
    np.savez_compressed(
        buffer,
        embedding=evaluated.embedding,
        frame=frame,
        seconds=np.array([evaluated.seconds[stage] for stage in STAGES]),
    )
    rewrite(path, seal_bytes(buffer.getvalue()))


def _read(path: Path) -> Evaluated:
    again = "delete it: it is evaluated anew"
    try:
        if not is_sealed(path):
            raise CorruptError(
                "a cached simulation is damaged, or of an older version", where=str(path), fix=again
            )
        content = read_arrays(path, what="a cached simulation", fix=again)
        embedding, frame, seconds = (
            content["embedding"],
            content["frame"],
            content["seconds"].tolist(),
        )
    except (OSError, ValueError, KeyError) as error:
        raise CorruptError(
            f"a cached simulation cannot be read: {error}", where=str(path), fix=again
        ) from None
    return Evaluated(
        embedding=embedding,
        frame=frame if frame.size else None,
        seconds=dict(zip(STAGES, seconds, strict=True)),
    )
