"""A scene for VTK's worker, and the film that is made of its pictures."""

from __future__ import annotations

import json
import math
import os
import subprocess
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from fractions import Fraction
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import av
import cv2
import numpy as np
from numpy.typing import NDArray

from flagdata.core.arrays import FloatArray, UInt8Array
from tests.studies.validation.environments import UnusableError

_WORKER = Path(__file__).with_name("worker.py")
_PLATE = 30.0
"""Distance of the background from what the camera looks at [m]."""
_WIDER = 1.5
"""Size of the background over what the camera sees of it: it may turn."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Body:
    """A mesh in the picture.

    Attributes:
        positions: (subframe, vertex, 3) [m], or (1, vertex, 3) of one that stands still.
        faces: (face, 3).
        colour: red, green and blue, 0 to 1; white under a texture.
        texture: (height, width, 3) with `uv`, (vertex, 2) from lower left; None for none.
        lit: whether light falls on it; a background brings its own.
    """

    positions: FloatArray
    faces: NDArray[np.integer]
    colour: tuple[float, float, float] = (1.0, 1.0, 1.0)
    texture: UInt8Array | None = None
    uv: FloatArray | None = None
    lit: bool = True
    ambient: float = 0.35
    diffuse: float = 0.65
    gloss: float = 0.05


@dataclass(frozen=True, kw_only=True)
class Light:
    """From far away.

    Attributes:
        towards: where it comes from.
    """

    towards: tuple[float, float, float]
    intensity: float
    colour: tuple[float, float, float] = (1.0, 1.0, 1.0)


@dataclass(frozen=True, kw_only=True, eq=False)
class View:
    """The camera.

    Attributes:
        size: width and height of the picture [px].
        target: what it looks at [m].
        yaw: from across the wind towards where it blows to [degrees].
        elevation: of the camera above the target [degrees].
        side: −1 for the side on which the wind blows to the right of the picture, 1 for the other.
        distance: [m].
        extent: width or height at the target, whichever is smaller [m].
        turned: (subframe, 3) further turns by yaw and pitch [px of the picture] and roll [degrees].
    """

    size: tuple[int, int]
    target: tuple[float, float, float]
    yaw: float
    elevation: float
    side: int
    distance: float
    extent: float
    turned: FloatArray

    @property
    def outward(self) -> FloatArray:
        """(3,) unit vector from the target to the camera."""
        yaw, up = math.radians(self.yaw), math.radians(self.elevation)
        return np.array(
            [math.sin(yaw) * math.cos(up), self.side * math.cos(yaw) * math.cos(up), math.sin(up)]
        )

    @property
    def right(self) -> FloatArray:
        """(3,) unit vector to the right of the picture."""
        across = np.cross(-self.outward, [0.0, 0.0, 1.0])
        return across / np.linalg.norm(across)

    @property
    def view_angle(self) -> float:
        """Of the picture's height [degrees]."""
        width, height = self.size
        return math.degrees(
            2 * math.atan(self.extent * height / min(width, height) / (2 * self.distance))
        )

    @property
    def settings(self) -> dict[str, Any]:
        target = np.array(self.target)
        return {
            "eye": (target + self.distance * self.outward).tolist(),
            "target": list(self.target),
            "view_angle": self.view_angle,
            "size": list(self.size),
        }

    def degrees(self) -> FloatArray:
        """(subframe, 3) of `turned`."""
        return self.turned * np.array(
            [self.view_angle / self.size[1], self.view_angle / self.size[1], 1.0]
        )

    def plate(self, picture: UInt8Array) -> Body:
        """What lies behind."""
        inward, right = -self.outward, self.right
        up = np.cross(right, inward)
        half = (
            0.5
            * _WIDER
            * self.extent
            / min(self.size)
            * max(self.size)
            * (self.distance + _PLATE)
            / self.distance
        )
        middle = np.array(self.target) + _PLATE * inward
        corners = [
            middle + half * (x * right + y * up) for x, y in ((-1, -1), (1, -1), (1, 1), (-1, 1))
        ]
        return Body(
            positions=np.array(corners)[None],
            faces=np.array([[0, 1, 2], [0, 2, 3]]),
            texture=picture,
            uv=np.array([[0, 0], [1, 0], [1, 1], [0, 1]], dtype=np.float64),
            lit=False,
            ambient=1.0,
            diffuse=0.0,
            gloss=0.0,
        )


@dataclass(frozen=True, kw_only=True)
class Camera:
    """What the camera and the file do with the light.

    Attributes:
        exposure: of the light.
        blur: deviation of the lens's point spread [px]; it smooths the steps that VTK draws along
            edges.
        noise: of each pixel [gray levels].
        crf: rate factor of H.264.
        mirrored: left and right exchanged.
    """

    exposure: float = 1.0
    blur: float = 0.6
    noise: float = 1.0
    crf: int = 22
    mirrored: bool = False


@dataclass(frozen=True, kw_only=True, eq=False)
class Scene:
    """All that a film shows.

    Attributes:
        bodies: in it, at `subframes` instants a frame.
        rate: of the film [Hz].
        frames: of it.
        subframes: whose mean a frame is: motion blur.
    """

    bodies: Sequence[Body]
    lights: Sequence[Light]
    view: View
    rate: Fraction
    frames: int
    subframes: int = 1
    camera: Camera = field(default_factory=Camera)


def pictures(python: Path, scene: Scene) -> Iterator[UInt8Array]:
    """(height, width, 3) of each frame, as VTK draws it.

    Raises:
        UnusableError: the worker failed.
    """
    arrays: dict[str, Any] = {"turned": scene.view.degrees()}
    bodies = []
    for number, body in enumerate(scene.bodies):
        name = f"body{number}"
        arrays |= {
            f"{name}_positions": body.positions.astype(np.float32),
            f"{name}_faces": body.faces,
        }
        if body.texture is not None:
            arrays |= {f"{name}_texture": body.texture, f"{name}_uv": body.uv}
        bodies.append(
            {
                "name": name,
                "colour": body.colour,
                "lit": body.lit,
                "ambient": body.ambient,
                "diffuse": body.diffuse,
                "gloss": body.gloss,
            }
        )
    settings = {
        **scene.view.settings,
        "bodies": bodies,
        "frames": scene.frames,
        "subframes": scene.subframes,
        "lights": [vars(light) for light in scene.lights],
    }
    width, height = scene.view.size
    with TemporaryDirectory(prefix="flagdata-vtk-") as folder:
        job = Path(folder, "job.npz")
        np.savez(job, settings=json.dumps(settings), **arrays)
        with Path(folder, "log").open("w+b") as log:
            worker = subprocess.Popen(
                (str(python), "-I", str(_WORKER), str(job)),
                stdout=subprocess.PIPE,
                stderr=log,
                env={**os.environ, "LP_NUM_THREADS": "1"},  # of the software renderer: one core
            )
            with worker as running:
                assert running.stdout is not None
                for _ in range(scene.frames):
                    content = running.stdout.read(width * height * 3)
                    if len(content) < width * height * 3:
                        break
                    yield np.frombuffer(content, dtype=np.uint8).reshape(height, width, 3)
                else:
                    return
            log.seek(0)
            raise UnusableError(
                log.read().decode(errors="replace")[-800:], where="VTK", fix="run make vtk"
            )


def film(python: Path, scene: Scene, path: Path, rng: np.random.Generator) -> None:
    """Write the film.

    Raises:
        UnusableError: the worker failed.
    """
    partial = path.with_suffix(f".{os.getpid()}.part.mp4")
    shown = (developed(one, scene.camera, rng) for one in pictures(python, scene))
    write(partial, shown, rate=scene.rate, crf=scene.camera.crf)
    partial.replace(path)


def developed(picture: UInt8Array, camera: Camera, rng: np.random.Generator) -> UInt8Array:
    """As the camera records it: exposed, with its noise, mirrored."""
    shown = cv2.GaussianBlur(picture.astype(np.float32), (0, 0), camera.blur)
    if camera.exposure != 1.0:
        shown *= camera.exposure ** (1 / 2.2)
    shown += camera.noise * rng.standard_normal(picture.shape[:2], dtype=np.float32)[..., None]
    out = np.clip(np.rint(shown), 0, 255).astype(np.uint8)
    return np.ascontiguousarray(out[:, ::-1]) if camera.mirrored else out


def write(path: Path, frames: Iterable[UInt8Array], *, rate: Fraction, crf: int) -> None:
    """An MP4 file of H.264 with 4:2:0 colours, of pictures (height, width, 3)."""
    stream: Any = None
    with av.open(str(path), "w") as container:
        for picture in frames:
            if stream is None:
                stream = container.add_stream("libx264", rate=rate)
                stream.height, stream.width = picture.shape[:2]
                stream.pix_fmt = "yuv420p"
                stream.options = {"crf": str(crf), "preset": "veryfast", "threads": "1"}
            container.mux(stream.encode(av.VideoFrame.from_ndarray(picture, format="rgb24")))
        container.mux(stream.encode(None))
