"""How many nulls are simulated, and that those of a design are kept."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from flagdata.errors import InputError
from measure.forecasting import Setting
from measure.inference import Nulls
from measure.nulls import GroupedConformal, NullBank, NullBatch, null_plan
from measure.nulls import bank as banks
from measure.probes import Statistics
from measure.trajectories import Experiment, Specimen, Trajectory, WindTrack
from sim.workers import kept_file


@pytest.fixture
def setting(specimen: Specimen, own_recording: Trajectory) -> Setting:
    return Setting.of(Experiment(specimen=specimen, recordings=(own_recording,)))


def asked(
    monkeypatch: pytest.MonkeyPatch,
    cache: Path,
    setting: Setting,
    *,
    nulls: int = 160,
    seed: int = 0,
) -> list[Path]:
    """Files that a simulated bank is kept in and read from."""
    found: list[Path] = []

    def simulate(batches: Sequence[banks.BankedNulls], *, folder: Path, **_: object) -> None:
        found.extend(kept_file(batch, folder) for batch in batches)

    def load(folder: Path, *, words: str, batches: Sequence[NullBatch]) -> list[Path]:
        return [kept_file(banks.BankedNulls(batch=batch), folder) for batch in batches]

    monkeypatch.setenv("FLAGDATA_CACHE", str(cache))
    monkeypatch.setattr(banks, "simulate_missing", simulate)
    monkeypatch.setattr(banks, "load", load)
    bank = null_plan.simulate_bank(
        setting, nulls=nulls, seed=seed, workers=1, stage=lambda *_: None
    )
    assert bank == found
    return found


def test_nulls_are_kept_by_their_design(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, setting: Setting
) -> None:
    usual = asked(monkeypatch, tmp_path, setting)
    assert {path.parent for path in usual} == {tmp_path / "nulls"}
    assert len(set(usual)) == 40
    # More of the same design are added to them; what the weight is known to does not shape them.
    more = asked(monkeypatch, tmp_path, setting, nulls=320)
    assert (more[:40], len(set(more))) == (usual, 80)
    weighed = replace(
        setting.experiment,
        specimen=replace(setting.experiment.specimen, area_weight_uncertainty=0.02),
    )
    assert asked(monkeypatch, tmp_path, replace(setting, experiment=weighed)) == usual
    noisy = tuple(replace(r, noise=2e-3) for r in setting.experiment.recordings)
    other = Setting.of(replace(setting.experiment, recordings=noisy))
    assert not set(asked(monkeypatch, tmp_path, other)) & set(usual)
    assert not set(asked(monkeypatch, tmp_path, setting, seed=1)) & set(usual)


def like(setting: Setting, **changed: Any) -> NullBank:
    """A bank of two recordings by each of four kinds of numerics, of the design of an
    experiment."""
    segments = 8
    markers = len(setting.segments.markers)
    one: dict[str, Any] = {
        "noise": np.full(segments, setting.design.noise),
        "period": np.full(segments, setting.design.period),
        "cloth": np.full(segments, setting.design.cloth),
        "markers": markers,
        "duration": setting.segments.duration,
        "anchors_given": True,
        "carried": False,
    } | changed
    return NullBank(
        nulls=Nulls(
            statistics=Statistics(
                recording=np.arange(segments),
                r=np.zeros((segments, 1)),
                response=np.zeros((segments, 1, 1)),
                error=np.zeros(segments),
                marker_error=np.zeros((segments, one["markers"])),
            ),
            speeds=np.full(segments, 4.0),
            calibration=np.zeros((segments, 3)),
            numerics=np.repeat(np.arange(4), 2),
            **{name: one[name] for name in ("noise", "period", "cloth")},
        ),
        columns=("lift.coefficient",),
        words="made",
        **{name: one[name] for name in ("duration", "anchors_given", "carried")},
    )


MIXED = np.tile([0.0, 1e-3], 4)


@pytest.mark.parametrize(
    ("changed", "refused"),
    [
        ({}, ""),
        ({"noise": np.full(8, 0.95e-3)}, ""),
        ({"noise": np.full(8, 4e-3)}, "a noise of 4 mm, the recordings have markers with a noise"),
        ({"noise": MIXED}, "a noise of 0, 1 mm, the recordings have markers with a noise of 1 mm"),
        ({"period": np.full(8, 1 / 60)}, "frames 16.7 ms apart, the recordings have frames 40 ms"),
        ({"period": np.tile([1 / 25, 1 / 60], 4)}, "frames 16.7, 40 ms apart"),
        ({"cloth": np.repeat(["denim", "knit"], 4)}, "the nominal cloth denim, knit, the record"),
        ({"markers": 12}, "12 markers, the recordings have 63 markers"),
        ({"duration": 5.0}, "segments of 5 s"),
        ({"carried": True}, "cloths that are carried"),
        ({"anchors_given": False}, "anchors taken from where recordings show the attachments"),
    ],
)
def test_a_bank_of_another_design_is_refused(
    setting: Setting, changed: dict[str, Any], refused: str
) -> None:
    noisy = tuple(replace(r, noise=1e-3) for r in setting.experiment.recordings)
    data = Setting.of(replace(setting.experiment, recordings=noisy))
    if not refused:
        null_plan.check(like(data, **changed), data)
        return
    with pytest.raises(InputError, match=refused) as error:
        null_plan.check(like(data, **changed), data, where="bank")
    assert error.value.where == "bank"
    assert error.value.fix == "simulate nulls for these recordings: leave the bank out"


def test_nulls_of_several_experiments_of_a_design_go_through_the_winds_of_all(
    setting: Setting,
) -> None:
    (own,) = setting.experiment.recordings
    faster = replace(own, wind=WindTrack.constant((8.0, 0.0, 0.0)))
    other = Setting.of(replace(setting.experiment, recordings=(faster,)))
    alone, alike = (
        null_plan.batches(setting, *others, kinds=2, seed=3) for others in ((), (other,))
    )
    assert max(speed for batch in alone for speed in batch.speeds) <= 4.4
    assert 6.6 < max(speed for batch in alike for speed in batch.speeds) <= 8.8
    assert [batch.calibrations for batch in alone] == [batch.calibrations for batch in alike]


@pytest.mark.parametrize(
    ("as_far", "wanted"),
    [(0, None), (1, 320), (2, 320), (4, None), (20, None)],
    ids=["below half the level", "at the level", "above it", "beyond twice the level", "far above"],
)
def test_more_are_simulated_where_p_is_near_the_level(as_far: int, wanted: int | None) -> None:
    """p = (1 + as far)/41."""
    conformal = GroupedConformal(
        null=np.where(np.arange(40) < as_far, 9.0, 1.0), kinds=np.arange(40)
    )
    said: list[str] = []

    def more(nulls: int, enough: int, most: int) -> int | None:
        return null_plan.more_nulls(
            nulls,
            enough,
            most,
            conformal,
            5.0,
            level=0.05,
            stage=lambda what, *_: said.append(what),
        )

    assert more(160, 160, 400) == wanted
    assert more(160, 160, 200) == (None if wanted is None else 200)
    assert more(320, 320, 320) is None
    assert said[0] == f"p = {(1 + as_far) / 41:.2g} by 40 of 40 kinds"


@pytest.mark.parametrize(("as_far", "wanted"), [(0, 160), (3, 160), (4, None), (20, None)])
def test_twenty_kinds_end_the_simulation_only_where_they_do_not_reject(
    as_far: int, wanted: int | None
) -> None:
    """Clopper and Pearson bound 3 and 4 of 20 by 0.042 and 0.071 from below; 1/21 is not enough to
    reject."""
    conformal = GroupedConformal(
        null=np.where(np.arange(20) < as_far, 9.0, 1.0), kinds=np.arange(20)
    )

    def more(nulls: int, enough: int, most: int, level: float = 0.05) -> int | None:
        return null_plan.more_nulls(
            nulls, enough, most, conformal, 5.0, level=level, stage=lambda *_: None
        )

    assert more(80, 160, 400) == wanted
    assert more(80, 100, 400) == (None if wanted is None else 100)
    # Eight kinds report a first p and decide nothing, however large it is.
    assert null_plan.first_round(null_plan.NullOptions()) == 32
    assert more(32, 160, 400) == 80
    assert more(32, 400, 400, 0.01) == 4 * 99
