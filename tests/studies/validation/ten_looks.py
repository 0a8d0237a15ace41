"""One flag's motion filmed in ten looks: what `flagdata measure` answers must not depend on the
print or the sky.

A flag is simulated once at each of three winds, from one seed, by the scene `flag-outdoor-damped`.
Each motion is filmed ten times by one camera, with the same noise and coding; only the cloth's
print, what is behind it and, for the silhouette, the light differ. Each film is a file, which is
measured as `flagdata measure` does by default, with the flag's size, once with its area weight open
and once stated. Prints are drawn here, not by what networks learn from, except for those that are
named after a texture of the package. Looks, winds, weight and seed were fixed before the first film
was measured.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from datetime import UTC, datetime
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
import torch

from flagdata.core.arrays import UInt8Array
from flagdata.core.rng import child_seed
from flagdata.core.stated import Stated
from flagdata.lake import MeshSequence, RaggedMeshSequence
from measure.estimate import Options
from measure.film import FlagSize
from measure.gate import WindowGate
from measure.measuring_model import Network, gate_beside, network
from measure.simulated_camera import write_film
from sim.assets import Assets
from sim.assets.flags import ROWS, FlagSheet
from sim.render import RenderParameters
from sim.run import Crew, Stepper, recipe_of
from sim.run import run as simulate
from tests.studies.validation.films import answer, contains

LENGTH, HEIGHT = 1.5, 1.0
"""[m]"""
RATE, SECONDS = 25, 12
"""Hz and s of a film: ten windows of the network."""
SIZE = (480, 360)
"""Of the picture [px]; the flat flag takes half of its width."""
_SCENE = "flag-outdoor-damped"
_OWN = "study"
"""Kind of the prints that are drawn here."""
_WHITE, _RED, _NAVY, _BLACK = "#ffffff", "#b22234", "#1c2a5c", "#101010"
_START = datetime(2026, 5, 14, 9, 30, tzinfo=UTC)
_CAMERA_ANGLE = math.radians(80.0)
_FRONT = _CAMERA_ANGLE + math.pi - math.radians(40.0)


def _quarters(sheet: FlagSheet) -> None:
    sheet.box(0.75, 0.0, 0.75, 0.5, _NAVY)
    sheet.box(0.0, 0.5, 0.75, 0.5, _NAVY)


def _stars_and_stripes(sheet: FlagSheet) -> None:
    """Thirteen stripes, and a canton of seven of them with nine staggered rows of stars."""
    stripe, canton = 1 / 13, (0.6, 7 / 13)
    for index in range(0, 13, 2):
        sheet.box(0.0, index * stripe, 1.5, stripe, _RED)
    sheet.box(0.0, 0.0, *canton, _NAVY)
    for row in range(9):
        for column in range(row % 2, 11, 2):
            sheet.star((column + 1) * canton[0] / 12, (row + 1) * canton[1] / 10, 0.031, _WHITE)


def _white(sheet: FlagSheet) -> None:
    sheet.fill(_WHITE)


def _dark(sheet: FlagSheet) -> None:
    sheet.fill(_BLACK)


PRINTS: Mapping[str, Callable[[FlagSheet], None]] = {
    "quarters": _quarters,
    "stars-and-stripes": _stars_and_stripes,
    "white": _white,
    "dark": _dark,
}
"""Drawn on a white sheet of 3:2."""


@dataclass(frozen=True, kw_only=True)
class Cloth:
    """A flag's cloth, and the winds that it is filmed in.

    Attributes:
        study: whose flag it is; it names the random streams and the files.
        title: of the sheet.
        area_weight: of the cloth [kg/m²].
        stated: range of it that is stated.
        winds: [m/s].
    """

    study: str
    title: str
    area_weight: float
    stated: Stated
    winds: tuple[float, ...]

    @property
    def stream(self) -> str:
        """The name of its random streams."""
        return self.study.replace("-", " ")


USUAL = Cloth(
    study="ten-looks",
    title="One flag in ten looks",
    area_weight=0.12,  # nylon or polyester, as most flags
    stated=Stated(low=0.114, high=0.126),
    winds=(3.0, 5.0, 8.0),
)


@dataclass(frozen=True, kw_only=True)
class StudyAssets(Assets):
    """The package's pictures, and the prints of this study as textures of the kind "study"."""

    def texture(self, name: str) -> UInt8Array:
        """Renders a texture by name; raises as that of `Assets`."""
        kind, _, member = name.partition("/")
        return _print(member) if kind == _OWN else super().texture(name)


@cache
def _print(name: str) -> UInt8Array:
    sheet = FlagSheet.blank(rows=ROWS, columns=ROWS * 3 // 2, colour=_WHITE)
    PRINTS[name](sheet)
    return sheet.bytes()


@dataclass(frozen=True, kw_only=True)
class Look:
    """What a film looks like.

    Attributes:
        name: for people.
        texture, background: names of pictures.
        light: render parameters in place of the usual light's.
    """

    name: str
    texture: str
    background: str
    light: Mapping[str, float] = field(default_factory=dict)

    def zeta(self) -> RenderParameters:
        """Render parameters: the one camera of all looks, and the light of a clear day from behind
        it."""
        width, height = SIZE
        usual = RenderParameters(
            texture=self.texture,
            background=self.background,
            camera_radius=8.0,
            camera_angle=_CAMERA_ANGLE,
            view_angle=math.radians(21.5),
            exposure_time=0.002,
            sun_azimuth=math.remainder(_FRONT, math.tau),
            sun_height=8.0,
            sun_radius=6.0,
            sun_softness=0.3,
            sun_strength=6.0,
            sky_strength=0.6,
            exposure_bias=-0.1,
            translucency=0.2,
            width=width,
            height=height,
            raster_samples=4,
        )
        return replace(usual, **dict(self.light))


_AGAINST_THE_LIGHT = {"sun_azimuth": _CAMERA_ANGLE, "exposure_bias": -1.5, "translucency": 0.0}
LOOKS = (
    Look(name="quarters", texture="study/quarters", background="sky/10"),
    Look(name="stars and stripes", texture="study/stars-and-stripes", background="sky/10"),
    Look(
        name="dark, against the light",
        texture="study/dark",
        background="sky/10",
        light=_AGAINST_THE_LIGHT,
    ),
    Look(name="white before clouds", texture="study/white", background="clouds/11"),
    Look(name="white before sky", texture="study/white", background="sky/10"),
    Look(name="print", texture="print/7", background="hills/3"),
    Look(name="weave", texture="weave/5", background="foliage/5"),
    Look(name="tricolour", texture="flag/france", background="buildings/6"),
    Look(name="disc on white", texture="flag/japan", background="clouds/2"),
    Look(name="stripes", texture="stripes/9", background="clouds/7"),
)


def run(*, seed: int, out: Path) -> dict[str, Any]:
    """Answers on the films of the usual cloth."""
    return graded(USUAL, seed=seed, out=out)


def graded(cloth: Cloth, *, seed: int, out: Path) -> dict[str, Any]:
    """Answers on all films of a cloth, their spread over the looks and their largest errors at each
    wind."""
    torch.set_num_threads(1)
    found = network(None, lake=None, at=None)
    gate = gate_beside(found, false_alarm=Options().false_alarm)
    rows: list[dict[str, Any]] = []
    for wind in cloth.winds:
        motion = flown(cloth, wind, seed=seed)
        rows += [
            {
                "wind": wind,
                "look": look.name,
                **answers(cloth, motion, look, found, gate, seed=seed),
            }
            for look in LOOKS
        ]
    sheet = {"model": found.estimator.name, "summary": summary(rows), "films": rows}
    (out / f"validate-{cloth.study}.md").write_text(page(cloth, sheet), encoding="utf-8")
    return sheet


def flown(cloth: Cloth, wind: float, *, seed: int) -> MeshSequence | RaggedMeshSequence:
    """Simulates the flag in a wind [m/s]; its cloth and its start are those of the seed, whatever
    the wind."""
    given = {
        "seed": child_seed(seed, cloth.stream),
        "count": 1,
        "batch": 1,
        "scene": {"width": LENGTH, "height": HEIGHT},
        "material": {"area-weight": cloth.area_weight},
        "wind": {"speed": wind},
        "time": {"settle": 3.0, "frames": RATE * SECONDS, "rate": float(RATE)},
    }
    crew = Crew(recipe_of(_SCENE, given))
    member = crew.member(0)
    (outcome,) = simulate(crew, Stepper.of(crew, member.base), [member], size=1)
    assert outcome.sequence is not None, outcome.failure
    return outcome.sequence


def answers(
    cloth: Cloth,
    motion: MeshSequence | RaggedMeshSequence,
    look: Look,
    found: Network,
    gate: WindowGate,
    *,
    seed: int,
) -> dict[str, Any]:
    """Films a motion in a look, and measures the file with its weight open and stated."""
    asked = {"open": None, "stated": cloth.stated}
    size = FlagSize(length=LENGTH, height=HEIGHT)
    with TemporaryDirectory() as folder:
        path = Path(folder) / "flag.mp4"
        filmed(path, motion, look, seed=child_seed(seed, cloth.stream, "camera"))
        return {
            name: answer(path, found, gate, Options(size=size, area_weight=weight))
            for name, weight in asked.items()
        }


def filmed(path: Path, motion: MeshSequence | RaggedMeshSequence, look: Look, *, seed: int) -> None:
    """Writes the film of a motion in a look; the camera's noise is that of the seed, whatever the
    look."""
    write_film(
        path,
        motion,
        look.zeta(),
        rate=RATE,
        start=_START,
        seed=seed,
        workers=1,
        advance=lambda _: None,
        assets=StudyAssets(),
    )


def summary(rows: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    """By weight and wind: of the films with an answer, how far winds lie apart [m/s] and how far
    from the true one.

    Returns:
        "open" and "stated" → wind → films, refused; lowest, highest, spread (highest less lowest),
            mean and the error
        of the largest size [m/s], or None where nothing is answered; and how many intervals contain
            the wind.
    """
    return {
        name: {
            f"{wind:g}": _at_wind([row[name] for row in rows if row["wind"] == wind], wind)
            for wind in sorted({row["wind"] for row in rows})
        }
        for name in ("open", "stated")
    }


def _at_wind(said: Sequence[Mapping[str, Any]], wind: float) -> dict[str, Any]:
    answered = [one["wind"] for one in said if not one["refused"]]
    found: dict[str, Any] = {"films": len(said), "refused": len(said) - len(answered)}
    if not answered:
        return {
            **found,
            **dict.fromkeys(("lowest", "highest", "spread", "mean", "largest_error", "contained")),
        }
    values = np.array([one["value"] for one in answered])
    errors = values - wind
    return {
        **found,
        "lowest": float(values.min()),
        "highest": float(values.max()),
        "spread": float(np.ptp(values)),
        "mean": float(values.mean()),
        "largest_error": float(errors[np.abs(errors).argmax()]),
        "contained": sum(contains(one, wind) for one in answered),
    }


def page(cloth: Cloth, sheet: Mapping[str, Any]) -> str:
    """The sheet in Markdown."""
    lines = [
        f"# {cloth.title}",
        "",
        (
            f"Model {sheet['model']}. One simulated flag of {cloth.area_weight:g} kg/m² and "
            f"{LENGTH:g} m by "
            f"{HEIGHT:g} m at {', '.join(f'{wind:g}' for wind in cloth.winds)} m/s, each motion "
            "filmed in "
            f"{len(LOOKS)} looks by one camera ({SECONDS} s at {RATE} Hz) and measured with the "
            "flag's size: with the "
            f"area weight open, and stated as {cloth.stated.low:g} to {cloth.stated.high:g} kg/m². "
            "What differs "
            "between the answers on one motion is the look's (`python -m tests.studies "
            f"{cloth.study}`)."
        ),
        "",
        (
            "| wind [m/s] | weight | refused | lowest | highest | spread | mean | largest error | "
            "intervals contain it |"
        ),
        "|---|---|---|---|---|---|---|---|---|",
    ]
    for name, winds in sheet["summary"].items():
        lines += [f"| {wind} | {name} | {_summed(own)} |" for wind, own in winds.items()]
    lines += [
        "",
        "## All films",
        "",
        "| look | "
        + " | ".join(f"{wind:g} m/s, {name}" for wind in cloth.winds for name in ("open", "stated"))
        + " |",
        "|---" * (1 + 2 * len(cloth.winds)) + "|",
    ]
    for look in dict.fromkeys(row["look"] for row in sheet["films"]):
        own = {row["wind"]: row for row in sheet["films"] if row["look"] == look}
        cells = [
            _cell(own[wind][name], wind) for wind in cloth.winds for name in ("open", "stated")
        ]
        lines.append(f"| {look} | " + " | ".join(cells) + " |")
    lines += [
        "",
        (
            "Winds in m/s with their 90 % intervals; one in bold does not contain the true wind. "
            "Of a refused film the "
            "estimate is that of `--anyway`, which counts for no spread and no error."
        ),
    ]
    return "\n".join(lines) + "\n"


def _summed(own: Mapping[str, Any]) -> str:
    if own["spread"] is None:
        return f"{own['refused']} of {own['films']} |" + " |" * 5
    answered = own["films"] - own["refused"]
    return (
        f"{own['refused']} of {own['films']} | {own['lowest']:.2f} | {own['highest']:.2f} | "
        f"{own['spread']:.2f} | "
        f"{own['mean']:.2f} | {own['largest_error']:+.2f} | {own['contained']} of {answered}"
    )


def _cell(said: Mapping[str, Any], true: float) -> str:
    if "wind" not in said:
        return f"refused: {', '.join(said['reasons'])}"
    own = said["wind"]
    ends = f"[{_end(own['low'])}, {_end(own['high'])}]"
    text = f"{own['value']:.2f} {ends if contains(own, true) else f'**{ends}**'}"
    return f"{text}, refused: {', '.join(said['reasons'][:2])}" if said["refused"] else text


def _end(value: float | None) -> str:
    return "" if value is None else f"{value:.2f}"
