"""The films that the measuring is judged by, as a list that was fixed before the first of them was
measured.

Three parts: `RATES`, one view of a run at every frame rate; `COVERAGE`, all undisturbed runs from
four views each, and some in denser air; `STRESSED`, a film and what a careless recording makes of
it. All is drawn from one seed, by names, so that a further film moves no other. A cameraman frames
the flag by what it visits; nothing else is looked at.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from fractions import Fraction
from types import MappingProxyType

import numpy as np

from flagdata.core.rng import stream
from tests.studies.validation.vtk_films.bodies import pole, shaking, sun, tree
from tests.studies.validation.vtk_films.pictures import BACKGROUNDS, TEXTURES, background, texture
from tests.studies.validation.vtk_films.runs import OTHER_AIR, UNDISTURBED, Motion
from tests.studies.validation.vtk_films.scene import Body, Camera, Scene, View

SEED = 20261127
ALL_RATES = {
    "23.976": Fraction(24000, 1001),
    "24": Fraction(24),
    "25": Fraction(25),
    "29.97": Fraction(30000, 1001),
    "30": Fraction(30),
    "48": Fraction(48),
    "50": Fraction(50),
    "59.94": Fraction(60000, 1001),
    "60": Fraction(60),
    "120": Fraction(120),
    "240": Fraction(240),
}
COMPARED = ("24", "25", "30", "60", "120")
"""Rates whose answers may differ by 0.1 m/s at most."""
_SIZES = ((640, 480), (480, 848), (1280, 720))
_DURATION = 6.0
"""Of a film [s]: three periods of a wind that varies."""
_SHORTER = {"120": 4.0, "240": 3.0}
"""Duration of films of these rates [s]: every film has its own pictures."""
_SHUTTERS = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.25, 0.5)
"""Share of the time between two frames for which the shutter is open; 0 for an instant."""


_SUBFRAMES = {0.0: 1, 0.25: 3, 0.5: 4}
_BEHIND = 6.0
"""How far behind the flag another one flies [m]."""


@dataclass(frozen=True, kw_only=True)
class Design:
    """One film.

    Attributes:
        name: of it, and of its file.
        part: "rates", "coverage", "other air" or "stressors".
        run: of ArcSim.
        rate: name of its frame rate, of `ALL_RATES`.
        start: of the film in the run [s].
        duration: [s].
        size: of the picture [px].
        texture, background: kinds.
        yaw, elevation: of the camera [degrees].
        side: of the flag on which the camera stands; see `scene.View`.
        distance: of the camera [m].
        share: of the flag's length in the picture's smaller side.
        aside: (2,) how far the flag's middle is from the picture's, in extents.
        shutter: share of a frame for which it is open.
        camera: what it records.
        shake: root mean square of the camera's shake [px].
        tree: whether one sways beside the flag.
        second: whether another flag flies behind.
        alike: name of what textures, background and light are drawn by.
    """

    name: str
    part: str
    run: str
    rate: str
    start: float = 0.37
    duration: float = _DURATION
    size: tuple[int, int] = _SIZES[0]
    texture: str = "stripes"
    background: str = "sky"
    yaw: float = 20.0
    elevation: float = -6.0
    side: int = -1
    distance: float = 8.0
    share: float = 0.6
    aside: tuple[float, float] = (0.0, 0.0)
    shutter: float = 0.0
    camera: Camera = field(default_factory=Camera)
    shake: float = 0.0
    tree: bool = False
    second: bool = False
    alike: str = ""

    @property
    def frames(self) -> int:
        """Of the film."""
        return math.floor(self.duration * ALL_RATES[self.rate])


def _rates() -> list[Design]:
    """One view of a run at 5 m/s at all rates, and of runs at 3 and 7 m/s at those that are
    compared."""
    return [
        Design(
            name=f"rates-w{wind}-{name}",
            part="rates",
            run=f"jittered/null_w{wind}",
            rate=name,
            duration=_SHORTER.get(name, _DURATION),
            texture="quarters",
            background="field",
            yaw=22.0,
            share=0.58,
            camera=Camera(noise=1.0, crf=20),
            alike=f"rates-{wind}",
        )
        for wind, names in ((5, tuple(ALL_RATES)), (3, COMPARED), (7, COMPARED))
        for name in names
    ]


_COVERAGE_RATES = (
    "30",
    "25",
    "59.94",
    "29.97",
    "24",
    "60",
    "30",
    "23.976",
    "25",
    "29.97",
    "24",
    "30",
    "50",
    "120",
    "30",
    "23.976",
    "25",
    "29.97",
    "48",
    "30",
    "240",
    "24",
    "60",
    "29.97",
    "25",
    "23.976",
    "30",
    "59.94",
    "30",
    "24",
    "25",
)
"""In the order of the films: of 31, so that each run and view meets others."""


def _coverage() -> list[Design]:
    """Every undisturbed run from four views, every run in denser air from two."""
    plan = [(run, view) for view in range(4) for run in UNDISTURBED] + [
        (run, view) for view in range(2) for run in OTHER_AIR
    ]
    found = []
    for number, (run, view) in enumerate(plan):
        short = run.rpartition("/")[2]
        rng = stream(SEED, "films", "coverage", short, view)
        rate = _COVERAGE_RATES[number % len(_COVERAGE_RATES)]
        fast = rate in _SHORTER
        length = 3.6 if short == "flag_w4_dt05" else _SHORTER.get(rate, _DURATION)
        spare = {"flag_w4_dt05": 4.0, "flag_w4_dt5": 16.0, "flag_w8_dt5": 16.0}.get(
            short, 10.0
        ) - length
        found.append(
            Design(
                name=f"coverage-{short}-{view}",
                part="other air" if run in OTHER_AIR else "coverage",
                run=run,
                rate=rate,
                start=float(rng.uniform(0, spare)),
                duration=length,
                size=_SIZES[int(rng.choice(3, p=(0.7, 0.2, 0.1)))],
                texture=str(rng.choice(list(TEXTURES))),
                background=str(rng.choice(list(BACKGROUNDS))),
                yaw=float(rng.uniform(15, 40)) * int(rng.choice([-1, 1])),
                elevation=float(rng.uniform(-16, 3)),
                side=int(rng.choice([-1, 1])),
                distance=float(rng.uniform(5, 20)),
                share=float(rng.uniform(0.45, 0.68)),
                aside=(float(rng.uniform(-0.06, 0.06)), float(rng.uniform(-0.06, 0.06))),
                shutter=0.0 if fast else float(rng.choice(_SHUTTERS)),
                camera=Camera(noise=float(rng.uniform(0.5, 3.0)), crf=int(rng.integers(18, 31))),
                alike=f"coverage-{short}-{view}",
            )
        )
    return found


STRESSORS: Mapping[str, Mapping[str, object]] = MappingProxyType(
    {
        "none": {},
        "shake of 1 px": {"shake": 1.0},
        "shake of 3 px": {"shake": 3.0},
        "tree": {"tree": True},
        "second flag": {"second": True},
        "40 % size": {"share": 0.4 * 0.6},
        "dusk": {"camera": Camera(exposure=0.1, noise=3.0, crf=23)},
        "crf 38": {"camera": Camera(crf=38)},
        "mirrored": {"camera": Camera(mirrored=True)},
    }
)
"""What is done to a film; the first is the film without."""


def _stressed() -> list[Design]:
    base = (
        Design(
            name="",
            part="stressors",
            run="jittered/null_w5",
            rate="30",
            texture="cross",
            background="field",
            yaw=-20.0,
            alike="stressed-5",
            start=0.9,
        ),
        Design(
            name="",
            part="stressors",
            run="jittered/full-hoist-attached_w7",
            rate="29.97",
            texture="disc",
            background="houses",
            yaw=30.0,
            side=1,
            alike="stressed-7",
            start=0.9,
        ),
    )
    return [
        replace(
            one,
            name=f"stressed-w{one.run[-1]}-{name.replace(' ', '-').replace('%', 'percent')}",
            **change,
        )
        for one in base
        for name, change in STRESSORS.items()
    ]


def stressor_of(design: Design) -> str:
    """Name of what was done to the film of a stressor."""
    ending = design.name.split("-", 2)[2]
    return next(
        name for name in STRESSORS if name.replace(" ", "-").replace("%", "percent") == ending
    )


def designs() -> list[Design]:
    """All of them, in the order in which they are made."""
    rates = _rates()
    return [*rates[: len(ALL_RATES)], *_coverage(), *_stressed(), *rates[len(ALL_RATES) :]]


def scene_of(design: Design, motion: Motion) -> Scene:
    """What VTK draws of a run."""
    rng = stream(SEED, "films", design.alike, "look")
    rate = ALL_RATES[design.rate]
    subframes = _SUBFRAMES[design.shutter]
    within = np.arange(subframes) / subframes * design.shutter if subframes > 1 else np.zeros(1)
    times = (design.start + (np.arange(design.frames)[:, None] + within) / float(rate)).ravel()
    cloth = motion.at(times)
    low, high = cloth.min(axis=(0, 1)), cloth.max(axis=(0, 1))
    extent = 1.5 / design.share
    yaw = math.radians(design.yaw)
    target = (low + high) / 2 - extent * np.array(
        [design.aside[0] * math.cos(yaw), design.aside[0] * math.sin(yaw), design.aside[1]]
    )
    view = View(
        size=design.size,
        target=(float(target[0]), float(target[1]), float(target[2])),
        yaw=design.yaw,
        elevation=design.elevation,
        side=design.side,
        distance=design.distance,
        extent=extent,
        turned=shaking(times, design.shake, stream(SEED, "films", design.alike, "shake")),
    )
    bodies = [
        view.plate(background(design.background, rng)),
        pole(
            0.022 + 0.016 * rng.random(),
            top=1.0 + 0.2 * rng.random(),
            gray=float(rng.uniform(0.25, 0.9)),
        ),
        Body(
            positions=cloth, faces=motion.faces, texture=texture(design.texture, rng), uv=motion.uv
        ),
    ]
    if design.tree:
        bodies += tree(times, view, stream(SEED, "films", design.alike, "tree"))
    if design.second:
        bodies += _second(motion, times, view, stream(SEED, "films", design.alike, "second"))
    return Scene(
        bodies=bodies,
        lights=sun(view, rng),
        view=view,
        rate=rate,
        frames=design.frames,
        subframes=subframes,
        camera=design.camera,
    )


def _second(motion: Motion, times: np.ndarray, view: View, rng: np.random.Generator) -> list[Body]:
    """The same cloth at another time, behind the first; its pole stands at the picture's edge,
    upwind of the first."""
    half = (
        0.5
        * view.extent
        * view.size[0]
        / min(view.size)
        * (view.distance + _BEHIND)
        / view.distance
    )
    place = np.array(view.target) - _BEHIND * view.outward + 0.95 * view.side * half * view.right
    place[2] -= 0.5
    turned = motion.duration - 0.04 - (times - times.min())  # backwards, so that it is no copy
    cloth = motion.at(np.clip(turned, 0.0, motion.duration)) + place
    stand = pole(0.03, top=1.1, gray=0.6)
    return [
        Body(positions=stand.positions + place, faces=stand.faces, colour=stand.colour),
        Body(positions=cloth, faces=motion.faces, texture=texture("stripes", rng), uv=motion.uv),
    ]
