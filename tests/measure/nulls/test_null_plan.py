"""How many nulls are simulated, and that those of a design are kept."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from measure.forecasting import Setting
from measure.nulls import GroupedConformal, NullBatch, null_plan
from measure.nulls import bank as banks
from measure.trajectories import Experiment, Specimen, Trajectory


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
) -> tuple[Path, int, int | None]:
    """Folder, batches built and kinds read of a simulated bank."""
    found: list[tuple[Path, int]] = []

    def build(folder: Path, batches: Sequence[NullBatch], **_: object) -> None:
        found.append((folder, len(batches)))

    monkeypatch.setenv("FLAGDATA_CACHE", str(cache))
    monkeypatch.setattr(banks, "build", build)
    monkeypatch.setattr(banks, "load", lambda folder, words, kinds: SimpleNamespace(kinds=kinds))
    bank = null_plan.simulate_bank(
        setting, nulls=nulls, seed=seed, workers=1, stage=lambda *_: None
    )
    ((folder, count),) = found
    return folder, count, bank.kinds  # pyright: ignore[reportAttributeAccessIssue]


def test_nulls_are_kept_by_their_design(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, setting: Setting
) -> None:
    folder, count, read = asked(monkeypatch, tmp_path, setting)
    assert folder.parent == tmp_path / "nulls"
    assert (count, read) == (40, 40)
    # More of the same design are added to them; what the weight is known to does not shape them.
    assert asked(monkeypatch, tmp_path, setting, nulls=320) == (folder, 80, 80)
    weighed = replace(
        setting.experiment,
        specimen=replace(setting.experiment.specimen, area_weight_uncertainty=0.02),
    )
    assert asked(monkeypatch, tmp_path, replace(setting, experiment=weighed))[0] == folder
    noisy = tuple(replace(r, noise=2e-3) for r in setting.experiment.recordings)
    other = Setting.of(replace(setting.experiment, recordings=noisy))
    assert asked(monkeypatch, tmp_path, other)[0] != folder
    assert asked(monkeypatch, tmp_path, setting, seed=1)[0] != folder


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
    assert null_plan.more_nulls(160, 160, 400, conformal, 5.0, level=0.05) == wanted
    assert null_plan.more_nulls(160, 160, 200, conformal, 5.0, level=0.05) == (
        None if wanted is None else 200
    )
    assert null_plan.more_nulls(320, 320, 320, conformal, 5.0, level=0.05) is None


@pytest.mark.parametrize(("as_far", "wanted"), [(0, 160), (3, 160), (4, None), (20, None)])
def test_twenty_kinds_end_the_simulation_only_where_they_do_not_reject(
    as_far: int, wanted: int | None
) -> None:
    """Clopper and Pearson bound 3 and 4 of 20 by 0.042 and 0.071 from below; 1/21 is not enough to
    reject."""
    conformal = GroupedConformal(
        null=np.where(np.arange(20) < as_far, 9.0, 1.0), kinds=np.arange(20)
    )
    assert null_plan.first_round(null_plan.NullOptions()) == 80
    assert null_plan.first_round(null_plan.NullOptions(level=0.01, nulls=400)) == 4 * 99
    assert null_plan.more_nulls(80, 160, 400, conformal, 5.0, level=0.05) == wanted
    assert null_plan.more_nulls(80, 100, 400, conformal, 5.0, level=0.05) == (
        None if wanted is None else 100
    )
