"""What a camera source is to the rest: facts read before decoding, then pictures in the order of
presentation."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from fractions import Fraction
from typing import Any, Protocol

from flagdata.core.findings import Finding
from flagdata.ingest.camera.frame_stamps import Timing
from flagdata.ingest.camera.gpmf import GpsTimes
from flagdata.ingest.camera.luma import Luma
from flagdata.ingest.camera.picture_geometry import Orientation


@dataclass(frozen=True, kw_only=True)
class SourceFacts:
    """Properties of a camera source once its first frame is decoded.

    Attributes:
        container, codec, pixel_format: names as FFmpeg has them.
        width, height: of the stored picture [px].
        aspect: width / height of a stored pixel.
        interlaced: whether the first frame says it is.
        metadata: of the container and of its video stream, keys lower-cased; the stream's win.
        recorded: the camera's wall-clock time inside the video stream, if it writes one there.
        sequence: whether the stamps were made from `sequence_fps`.
        findings: what opening it found.
        stamped: instant of the first frame [UTC ns], where stamps state the day and the time; else
            `None`.
        gps: times that the camera's telemetry states by GPS, if it does.
        data_set: columns of the catalog that a data set states of its film: "dataset" and "side",
            "seed", "session".
    """

    container: str
    codec: str
    pixel_format: str
    width: int
    height: int
    aspect: Fraction
    orientation: Orientation
    interlaced: bool
    timing: Timing
    metadata: Mapping[str, str]
    recorded: str | None
    sequence: bool
    findings: tuple[Finding, ...]
    stamped: int | None = None
    gps: GpsTimes | None = None
    data_set: Mapping[str, Any] = field(default_factory=dict)


@dataclass(frozen=True, kw_only=True)
class Picture:
    """A decoded picture whose luma is taken only when it is needed.

    Attributes:
        stamp: in ticks of the source's timing, `None` where the file has none.
    """

    stamp: int | None
    luma: Callable[[], Luma]


class PictureSource(Protocol):
    """A camera file or image sequence, open."""

    @property
    def facts(self) -> SourceFacts: ...

    def pictures(self) -> Iterator[Picture]:
        """Yields decoded pictures in order of presentation; once."""
        ...

    def samples(self, runs: int, count: int, stride: int) -> Iterator[list[Picture]]:
        """Yields at most `runs` runs of at most `count` pictures, every `stride`-th, spread over
        it; any number of times."""
        ...

    def damage(self) -> list[Finding]:
        """Reports what could not be decoded; complete when `pictures` has ended."""
        ...

    def close(self) -> None: ...
