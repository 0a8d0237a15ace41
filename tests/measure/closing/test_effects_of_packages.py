"""Effects of a package that is installed: weighed and named by the registry alone, from markers and
from films, or listed with the reason why they are not."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import pytest

from measure.closing import close_loop
from measure.cloth import Flag, solve, verdict_of, weighable
from measure.forecasting import Calibration, Suspicion, library, on_films, on_markers, regressors
from measure.loop import LoopOptions
from measure.nulls import NullBatch
from measure.nulls import bank as banks
from measure.report.effect_answer import answer_effect
from measure.trajectories import Experiment, Specimen
from measure.verdict import Conclusion
from sim.effects import EFFECTS, Effect
from tests.measure.cloth.loop.conftest import cheap as cheap
from tests.measure.cloth.loop.conftest import options, recording

PACKAGE = '''
"""A fan beside the flag."""

from dataclasses import dataclass
from typing import Annotated

import torch

from flagdata.extend import ForceEffect, Need, Value, strength

SOURCE = "made for a test of packages"


@dataclass(frozen=True, kw_only=True)
class Fan(ForceEffect):
    """A force per mass b across the wind, alike all over.

    Attributes:
        acceleration: b.
    """

    acceleration: Annotated[
        Value, strength(unit="m/s²", prior=(-10.0, 10.0), source=SOURCE)
    ] = 0.0

    def force(self, cloth, time, position, velocity, wind):
        across = torch.zeros_like(position).index_fill(1, torch.tensor(1), 1.0)
        return across * cloth.mass[:, None] * self.acceleration


class Profile(Fan):
    """The same where the wind has a profile."""

    needs = {Need.MAST: "the profile is no other way to be known"}
'''
KINDS, DURATION, NOISE = 9, 4.6, 5e-4
BESIDE = {"lift", "air-density", "tangential-linear-drag", "full-hoist", "direction-change"}


@pytest.fixture(scope="module")
def fan(tmp_path_factory: pytest.TempPathFactory) -> Iterator[type[Effect]]:
    """The package as if it were installed."""
    folder = tmp_path_factory.mktemp("site")
    (folder / "fan_of_another.py").write_text(PACKAGE, encoding="utf-8")
    info = folder / "fans-1.dist-info"
    info.mkdir()
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: fans\nVersion: 1\n")
    (info / "entry_points.txt").write_text(
        "[flagdata.effects]\nfan = fan_of_another:Fan\nprofile = fan_of_another:Profile\n"
        "torn = fan_of_another:Nothing\n"
    )
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(str(folder))
        patch.setattr(EFFECTS, "_found", None)
        yield EFFECTS["fan"]
    EFFECTS._found = None
    sys.modules.pop("fan_of_another", None)


def test_it_is_a_candidate_of_both_kinds_of_verdict_at_the_strengths_of_its_prior(
    fan: type[Effect],
) -> None:
    assert library()[-1].name == "fan.acceleration"
    for candidates in (on_markers(), on_films()):
        (own,) = (one for one in candidates if one.column.effect == "fan")
        assert (own.low, own.high, own.signs, own.column.step) == (-10.0, 10.0, (1, -1), 1.0)
        assert not [one for one in candidates if one.column.effect == "profile"]
        assert Suspicion.parse("fan+", candidates).name == "fan.acceleration"
    described = answer_effect("fan").document
    assert described["package"] == "package fans"
    assert described["parameters"]["acceleration"]["meaning"] == "b."
    assert set(described["recordings"].values()) == {"weighed"}
    of_a_mast = answer_effect("profile").document["recordings"].values()
    assert all(text.startswith("not weighed: it needs a mast") for text in of_a_mast)


def test_it_is_named_from_markers_and_what_was_not_weighed_is_listed(
    fan: type[Effect], specimen: Specimen, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Nine kinds of numerics, the fewest that can test a level of 0.1; of flagdata's own effects
    five, since each costs a simulation of all nulls."""
    kept = [c for c in regressors.registered_columns() if c.effect in {*BESIDE, "fan"}]
    monkeypatch.setattr(regressors, "registered_columns", lambda: kept)
    alike = {
        "markers": specimen.mesh.rest,
        "rate": 25.0,
        "duration": DURATION,
        "noise": NOISE,
    }
    nulls = [
        banks.prior_batch(specimen, **alike, speeds=(3.0, 6.5), seed=seed)  # pyright: ignore[reportArgumentType]
        for seed in range(KINDS)
    ]
    banks.build(tmp_path, nulls)
    blown = NullBatch(
        specimen=specimen,
        **alike,  # pyright: ignore[reportArgumentType]
        speeds=(3.5, 6.0),
        calibrations=(Calibration(area_weight=1.1, bending=0.7, damping=2e-3),) * 2,
        seed=77,
        effects=(fan(acceleration=6.0),),  # pyright: ignore[reportCallIssue]
    )
    # A push across the wind is also what a wind does that is turned from its log, which a verdict
    # names whatever its test says; of a log whose direction is exact that is one more effect.
    recordings = tuple(
        replace(one, wind=replace(one.wind, direction=0.0)) for one in blown.simulate()
    )
    experiment = Experiment(specimen=specimen, recordings=recordings)
    found = close_loop(experiment, LoopOptions(bank=tmp_path, level=0.1))
    assert (found.conclusion, found.named) == (Conclusion.EFFECT, ("fan",))
    (named,) = (one for one in found.ranking if not one.why_not)
    assert named.strength.low < 6.0 < named.strength.high
    unweighed = dict(found.unweighed)
    assert unweighed["profile"] == (
        "it needs a mast that measures the wind at several heights: "
        "the profile is no other way to be known"
    )
    assert "package fans" in unweighed["torn"]
    assert "fan" not in unweighed


def test_it_is_named_from_films(fan: type[Effect], cheap: list[int], tmp_path: Path) -> None:
    recordings = [
        recording(mean=mean, seed=6, effects={"fan.acceleration": 8.0}) for mean in (4.0, 6.5)
    ]
    weighed = {one.name for one in weighable(Flag(length=1.5, height=1.0))}
    assert "fan.acceleration" in weighed
    among = replace(options(), only=("fan.acceleration", "lift.coefficient", "shear.exponent"))
    found = verdict_of(solve(recordings, among, folder=tmp_path))
    assert (found.conclusion, found.named) == (Conclusion.EFFECT, ("fan",))
    assert dict(found.unweighed)["profile"].startswith("it needs a mast")
