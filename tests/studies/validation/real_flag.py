"""What the shipped model says of a real flag, of which nobody knows the wind: windows of one clip,
and its own doubt.

The clip (DynTex 571c110, 352×288, 25 Hz, 250 frames) is read from ../shared/data. There is no truth
to compare with: the evidence is whether windows of one steady scene agree within their intervals,
and whether the model knows that it was not trained on such pictures.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import av
import numpy as np

from models.trained import estimator
from tests.evidence import ABSENT, REFERENCE

_CLIP = "video/dyntex_flag_571c110.avi"
_LEVEL = 0.9


def run(*, seed: int, out: Path) -> dict[str, Any]:
    """Estimates of non-overlapping windows, and a picture of them."""
    path = REFERENCE / _CLIP
    if not path.exists():
        return dict(ABSENT)
    with av.open(str(path)) as container:
        film = np.stack([frame.to_ndarray(format="gray") for frame in container.decode(video=0)])
    model = estimator.load_shipped()
    count = model.front_end.frames
    clips = np.stack(
        [film[first : first + count] for first in range(0, len(film) - count + 1, count)]
    )
    found = model.estimate(model.inputs(clips), seed=seed)
    low, high = found.interval(_LEVEL)
    names = [target.name for target in found.targets]
    windows = [
        {
            "seconds": [k * count / model.front_end.rate, (k + 1) * count / model.front_end.rate],
            **{name: [found.mean[k, t], low[k, t], high[k, t]] for t, name in enumerate(names)},
            "p_unlike": None if found.unlike is None else float(found.unlike[k]),
        }
        for k in range(len(clips))
    ]
    wind = names.index("wind_speed")
    _draw(
        out / "validate-real-flag.png",
        found.mean[:, wind],
        low[:, wind],
        high[:, wind],
        found.unlike,
    )
    _frames(out / "validate-real-flag-frames.jpg", clips)
    return {"clip": _CLIP, "level": _LEVEL, "model": model.name, "windows": windows}


def _draw(
    path: Path, mean: np.ndarray, low: np.ndarray, high: np.ndarray, unlike: np.ndarray | None
) -> None:
    from matplotlib.figure import Figure

    figure = Figure(figsize=(7, 3), dpi=110, layout="constrained")
    axes = figure.subplots()
    places = np.arange(len(mean))
    axes.errorbar(places, mean, yerr=[mean - low, high - mean], fmt="o")
    axes.set(
        xlim=(-0.5, len(mean) - 0.5),
        ylim=(0, 10),
        ylabel="wind [m/s], 90 %",
        xlabel="window of 30 frames",
    )
    for place, p in zip(places, [] if unlike is None else unlike, strict=False):
        axes.annotate(f"p = {p:.2g}", (place, 9.3), ha="center", fontsize=8)
    axes.set_title("p of a clip as unlike the training clips as this one", fontsize=9)
    figure.savefig(path)


def _frames(path: Path, clips: np.ndarray) -> None:
    """The middle frames beside one another; of the reference data, so that it is kept out of the
    repository."""
    from PIL import Image

    Image.fromarray(np.concatenate([clip[len(clip) // 2] for clip in clips], axis=1)).save(path)
