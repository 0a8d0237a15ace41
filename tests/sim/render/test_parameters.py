"""ζ and the priors it is drawn from."""

from __future__ import annotations

import math
import tomllib
from importlib.resources import files

import numpy as np
import pytest

from flagdata.core.json_values import json_values
from flagdata.errors import InputError, UnknownNameError, UsageError
from flagdata.recipes.typed_tables import Range
from sim.assets import BACKGROUNDS, TEXTURES, Assets
from sim.render import RenderParameters
from sim.render import render_prior as priors
from tests.refusals import unrefused

DRAWS = 150

# Runia et al. 2020, appendix, "Exhaustive overview of the render parameters ζ".
PAPER = {
    "flags": {
        "background_scale": (0.6, 1.0),
        "sun_height": (4, 10),
        "sun_radius": (0, 5),
        "sun_strength": (2, 10),
        "sun_softness": (2, 10),
        "camera_height": (0.2, 3),
        "camera_radius": (4, 6),
        "mesh_height": (4.6, 4.6),
        "background_offset_x": (-20, 20),
        "background_offset_y": (-20, 20),
        "cycles_samples": (50, 50),
        "cycles_bounces": (0, 6),
    },
    "cloth": {
        "background_scale": (0.6, 1.0),
        "sun_height": (4, 10),
        "sun_radius": (0, 5),
        "sun_strength": (2, 10),
        "sun_softness": (2, 10),
        "camera_height": (0.5, 2),
        "camera_radius": (1, 2.5),
        "mesh_height": (2, 2),
        "camera_angle": (-math.radians(5), math.radians(5)),
        "cycles_samples": (50, 50),
        "cycles_bounces": (0, 6),
    },
}


@pytest.mark.parametrize("name", sorted(PAPER))
def test_draws_fill_the_papers_ranges(name) -> None:
    prior = priors.named_prior(name)
    drawn = [prior.draw(seed, Assets()) for seed in range(DRAWS)]
    for parameter, (low, high) in PAPER[name].items():
        values = np.array([getattr(zeta, parameter) for zeta in drawn])
        assert low <= values.min() <= values.max() <= high
        # The extremes of 150 uniform draws are within 5 % of the ends but with probability 5e-4
        # each; seeds are fixed.
        assert values.min() <= low + 0.05 * (high - low)
        assert values.max() >= high - 0.05 * (high - low)


def test_flags_are_never_seen_along_the_wind() -> None:
    prior = priors.named_prior("flags")
    angles = np.array([prior.draw(seed, Assets()).camera_angle for seed in range(DRAWS)])
    assert np.abs(np.sin(angles)).min() >= math.sin(math.radians(15))
    assert (angles > 0).any()
    assert (angles < 0).any()  # from both sides


@pytest.mark.parametrize("name", priors.PRIORS.names())
def test_every_catalog_prior_has_sources_and_draws_what_there_is(name) -> None:
    prior = priors.named_prior(name)
    assert set(prior.sources) == set(prior.quantities)
    zeta = prior.draw(1, Assets())
    assert zeta.texture.split("/")[0] in TEXTURES
    assert zeta.background.split("/")[0] in BACKGROUNDS


def test_a_seed_gives_one_draw_and_a_changed_range_moves_no_other_parameter() -> None:
    prior = priors.named_prior("flags")
    assert prior.draw(7, Assets()) == prior.draw(7, Assets())
    assert prior.draw(7, Assets()) != prior.draw(8, Assets())
    changed = prior.with_quantities({"sun_height": Range(low=1.0, high=2.0)}, source="a test").draw(
        7, Assets()
    )
    before, after = json_values(prior.draw(7, Assets())), json_values(changed)
    assert {name for name in before if before[name] != after[name]} == {"sun_height"}


def test_without_sun_and_sky_there_is_nothing_to_expose_for() -> None:
    zeta = RenderParameters(background="a", texture="b", sun_strength=0.0, sky_strength=0.0)
    assert zeta.gain == 0.0


def test_a_value_that_makes_no_sense_is_refused_by_name() -> None:
    cases = [
        ("sun_height", 0.0),
        ("sun_height", math.nan),
        ("camera_radius", 0.0),
        ("width", 0),
        ("width", 30.5),
        ("translucency", 1.2),
        ("raster_samples", True),
        ("background_scale", "1"),
        ("texture", ""),
        ("background", 3),
    ]
    good = {"background": "a", "texture": "b"}
    named = [(name, value, name) for name, value in cases]
    assert not unrefused(
        lambda name, value: RenderParameters(**{**good, name: value}), named, InputError
    )


def content(**changes: object) -> dict[str, object]:
    text = (files("catalogs") / "renders" / "flags.toml").read_text(encoding="utf-8")
    return tomllib.loads(text) | changes


def test_a_prior_file_that_is_wrong_says_where() -> None:
    cases = [
        ({"mine": {"source": "me", "sun-hight": 3.0}}, UsageError, "sun-hight"),
        ({"mine": {"sun-azimuth-deg": 3.0}}, InputError, "no source"),
        ({"mine": {"source": "me", "sun-height": 3.0}}, InputError, "given twice"),
        ({"textures": []}, InputError, "no textures"),
        ({"least-angle-deg": 90.0}, InputError, "from the heading"),
        (
            {"chosen": {"source": "me", "translucency": {"low": 0.5, "high": 1.5}}},
            InputError,
            "translucency",
        ),
        ({"sun": 3.0}, InputError, "not a table"),
    ]
    assert not unrefused(lambda changes: priors.read(content(**changes), name="test"), cases)


def test_a_range_without_an_angle_that_shows_the_flag_is_refused() -> None:
    narrow = Range(low=math.radians(170), high=math.radians(188))
    with pytest.raises(InputError, match="from the heading"):
        priors.named_prior("flags").with_quantities({"camera_angle": narrow}, source="a test")


def test_unknown_names_are_answered_with_the_nearest() -> None:
    with pytest.raises(UnknownNameError, match="did you mean 'flags'"):
        priors.named_prior("flag")
    with pytest.raises(UnknownNameError, match="sun_height"):
        priors.named_prior("flags").with_quantities({"sun_hight": 3.0}, source="a test")
