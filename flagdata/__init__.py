"""flagdata: the lake of recordings and simulations of cloth in the wind, and the command line."""

from __future__ import annotations

from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from flagdata.dataset.source import Source
    from flagdata.measured import Measured
    from flagdata.stated import Stated
    from flagdata.storage import Place

__all__ = ["measure", "open"]


def open(path: Place | str) -> Source:  # noqa: A001 — read as flagdata.open
    """The lake in the folder `path`, or at `s3://bucket/prefix`, as a source of typed pairs; `.lake` is the lake.

    Raises:
        NotFoundError: no lake there.
    """
    from flagdata.dataset.source import Source

    return Source.open(path)


def measure(
    source: Path | str,
    *,
    flag_size: tuple[float, float] | None = None,
    area_weight: float | tuple[float, float] | str | Stated | None = None,
    material: str | None = None,
    step: float | None = None,
    crop: tuple[int, int, int, int] | None = None,
    flag: int | None = None,
    start: float | None = None,
    end: float | None = None,
    true_fps: float | None = None,
    sequence_fps: float | None = None,
    level: float = 0.9,
    seed: int = 0,
    model: str | None = None,
    false_alarm: float = 0.05,
    lake: Path | str | None = None,
    at: str | None = None,
    anyway: bool = False,
) -> Measured:
    """Wind and area weight of a film of a flag, as `flagdata measure` gives them; nothing is written.

    A film unlike those the network was trained on is refused: it is returned with `refused` and the reasons, and asking
    it for values raises `RefusedError`.

    Args:
        source: a video file, a folder of images, or a recording, clip or camera of the lake by its name or id.
        flag_size: length along the wind and height along the pole [m]; of a hanging cloth width and height.
        area_weight: of the cloth [kg/m²]: a value, a range (low, high), or a text such as "0.284±0.01".
        material: instead, the name of a cloth whose area weight is taken.
        step: from one window to the next [s]; by default windows follow each other.
        crop: region in which the flag is: x, y, width, height [px].
        flag: number of the moving cloth; by default the one that moves most.
        start, end: part of the film [s].
        true_fps: rate at which a high-speed camera really ran [Hz].
        sequence_fps: rate of a folder of images [Hz].
        level: of the intervals.
        seed: of all draws; the same film, options and seed give the same draws.
        model: name or folder of the network, or its name or id in the lake.
        false_alarm: share of familiar films that the gate may refuse.
        lake: folder of the lake that names films, fabrics and networks.
        at: tag, branch or version of the lake.
        anyway: whether the values of a refused film are returned too, if anything moves in it.

    Raises:
        UsageError: options that contradict each other, or values that no flag has.
        NotFoundError: no such film, lake or network.
        RefusedError: a film that is too slow, or whose frames repeat too often, so that no window of it can be looked
            at and there is nothing to return.
        InputError: a file that is no film, or a film that is too short.
    """
    # By its name, as the command line names its verbs: flagdata imports none of the packages that rest on it.
    measured: Measured = import_module("measure.estimate.run").measured(
        source, flag_size=flag_size, area_weight=area_weight, material=material, step=step, crop=crop, flag=flag,
        start=start, end=end, true_fps=true_fps, sequence_fps=sequence_fps, level=level, seed=seed, model=model,
        false_alarm=false_alarm, lake=lake, at=at, anyway=anyway,
    )  # fmt: skip
    return measured
