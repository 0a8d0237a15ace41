"""Verdicts on a cloth that is carried, by nulls that are carried along the same ways."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from flagdata.errors import InputError
from measure.closing import close_loop
from measure.forecasting import Calibration, Setting
from measure.loop import LoopOptions
from measure.nulls import SETTLE, NullBatch, null_plan
from measure.nulls import bank as banks
from measure.trajectories import (
    AttachmentTrack,
    Experiment,
    Hold,
    Observation,
    Setup,
    Specimen,
    WindTrack,
    from_arrays,
    hold,
    model_mesh,
    observe,
    sheet,
)
from measure.verdict import NOT_REJECTED
from sim.cloth.material import named_material
from sim.effects import EFFECTS, Effect
from tests.program import invoke

SIZE, RATE, DURATION, NOISE, FAR, VERTICES = 0.4, 25.0, 4.6, 5e-4, 0.12, 36
KINDS = 12
LEVEL = 0.1
"""Twelve kinds can test at 1/13."""
CLOTH = Calibration(area_weight=1.05, bending=0.8, damping=3e-3)
SETUP = Setup(
    outline=sheet(SIZE, SIZE),
    material=named_material("camel-ponte-roma"),
    pins=Hold.TOP_CORNERS,
    carried=True,
    vertices=VERTICES,
)
DRAG = EFFECTS["tangential-linear-drag"](coefficient=0.8)


def specimen() -> Specimen:
    mesh, held = hold(model_mesh(sheet(SIZE, SIZE), vertices=VERTICES), Hold.TOP_CORNERS)
    seats = mesh.rest[list(held)]
    anchors = np.stack([seats[:, 0], 0 * seats[:, 0], seats[:, 1]], axis=1)
    return Specimen(
        mesh=mesh,
        material=named_material("camel-ponte-roma"),
        held=held,
        anchors=anchors,
        stiffness=math.inf,
        anchors_given=False,
    )


def ways(anchors: np.ndarray) -> tuple[AttachmentTrack, ...]:
    """Two: to and fro along y by FAR, along x by half of it, at frequencies of their own."""
    times = np.arange(-SETTLE, DURATION + 1, 0.01)
    made = []
    for (along, across), phase in zip([(0.85, 0.65), (0.7, 1.05)], [0.0, 2.0], strict=True):
        moved = np.zeros((len(times), *anchors.shape))
        moved[:, :, 1] = (FAR * np.sin(2 * math.pi * along * times + phase))[:, None]
        moved[:, :, 0] = (FAR / 2 * np.sin(2 * math.pi * across * times))[:, None]
        made.append(AttachmentTrack(times=times, places=anchors + moved))
    return tuple(made)


def observations(*effects: Effect, seed: int) -> list[Observation]:
    """Recordings of one cloth along both ways, by a mesh and steps of their own."""
    cloth = specimen()
    batch = NullBatch(
        specimen=cloth,
        markers=cloth.mesh.rest,
        rate=RATE,
        duration=DURATION,
        noise=NOISE,
        calibrations=(CLOTH,) * 2,
        speeds=(0.0, 0.0),
        seed=seed,
        tracks=ways(cloth.anchors),
        effects=effects,
    )
    calm = WindTrack.constant((0.0, 0.0, 0.0))
    return [
        from_arrays(
            name=f"way {k}",
            positions=r.positions,
            rest=r.markers,
            rate=RATE,
            wind=calm,
            noise=NOISE,
        )
        for k, r in enumerate(batch.simulate())
    ]


def experiment(*effects: Effect, seed: int) -> Experiment:
    return observe(observations(*effects, seed=seed), SETUP).experiment


@pytest.fixture(scope="module")
def bank(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Nulls of the ways that a recording without effects shows."""
    folder = tmp_path_factory.mktemp("carried")
    banks.build(folder, null_plan.batches(Setting.of(experiment(seed=1)), kinds=KINDS, seed=3))
    return folder


def test_carried_cloths_without_effects_are_accepted_by_the_count_of_kinds(bank: Path) -> None:
    """Twelve kinds of numerics reject at 1/13: two or more of four by chance in 3 of 100 such
    draws."""
    verdicts = [
        close_loop(experiment(seed=seed), LoopOptions(bank=bank, level=LEVEL))
        for seed in (5, 9, 11, 20)
    ]
    accepted = [verdict for verdict in verdicts if verdict.conclusion in NOT_REJECTED]
    assert len(accepted) >= 3
    for verdict in verdicts:
        test = verdict.test
        assert test.kinds == KINDS
        # Each kind counts for the share of its groups that are as far, and the data for one more
        # kind.
        as_far = np.array(test.null) >= test.statistic
        assert 1 / (KINDS + 1) <= test.p_value.point <= (1 + as_far.sum()) / (KINDS + 1)
        assert (test.p_value.point > LEVEL) == (verdict in accepted)
        assert "carried along the recordings' own ways" in test.nulls
        assert any("carried where the markers at them go" in words for words in verdict.assumptions)


def test_the_first_by_its_score_is_what_acts_on_a_carried_cloth(bank: Path) -> None:
    """Twelve kinds show too little of how they scatter to reject by it: p is by 40 elsewhere."""
    verdict = close_loop(experiment(DRAG, seed=77), LoopOptions(bank=bank, level=LEVEL))
    first, second = verdict.ranking[:2]
    assert first.effect == "tangential-linear-drag"
    assert first.z == verdict.test.directed == verdict.test.statistic > second.z


def test_nulls_of_cloths_held_still_do_not_judge_one_that_is_carried(bank: Path) -> None:
    data = experiment(seed=1)
    setting = Setting.of(data)
    loaded = null_plan.load_bank(bank, setting)
    still = Setting.of(
        replace(data, recordings=tuple(replace(own, attachments=None) for own in data.recordings))
    )
    with pytest.raises(
        InputError, match="cloths that are carried, the recordings have cloths that are held still"
    ):
        null_plan.check(loaded, still)


def test_the_ways_of_the_data_shape_their_nulls() -> None:
    """Recordings that differ by their ways alone have nulls of their own."""
    setting = Setting.of(experiment(seed=1))
    first, *others = setting.experiment.recordings
    assert first.attachments is not None
    moved = replace(first, attachments=first.attachments + 1e-3)
    elsewhere = replace(
        setting, experiment=replace(setting.experiment, recordings=(moved, *others))
    )
    ours, others = (null_plan.batches(own, kinds=1, seed=3)[0] for own in (setting, elsewhere))
    assert ours.identity() != others.identity()
    assert ours.identity() == null_plan.batches(setting, kinds=2, seed=3)[0].identity()


def test_close_loop_judges_a_table_of_a_carried_cloth(bank: Path, tmp_path: Path) -> None:
    lines = ["recording,frame,marker,u,v,x,y,z"]
    for seen in observations(seed=5):
        for frame, places in enumerate(seen.positions):
            for marker, ((u, v), (x, y, z)) in enumerate(zip(seen.markers, places, strict=True)):
                lines.append(
                    f"{seen.name},{frame},m{marker},{u:.6f},{v:.6f},{x:.6f},{y:.6f},{z:.6f}"
                )
    table = tmp_path / "tracks.csv"
    table.write_text("\n".join(lines) + "\n", encoding="utf-8")
    recipe = tmp_path / "carried.toml"
    source = f'source = "tracks.csv"\nrate = {RATE}\nnoise = {NOISE}\nwind = {{ speed = 0 }}'
    takes = "\n".join(f'[[recording]]\ntake = "way {k}"\n{source}' for k in range(2))
    recipe.write_text(
        f"[cloth]\nwidth = {SIZE}\nheight = {SIZE}\nvertices = {VERTICES}\n[material]\nname = "
        '"camel-ponte-roma"\n'
        f'[attachment]\nat = "top-corners"\ncarried = true\n{takes}\n',
        encoding="utf-8",
    )
    options = ("--bank", bank, "--level", LEVEL, "--json", "--out", tmp_path / "loop")
    ended = invoke("close-loop", recipe, *options)
    assert ended.code == 0
    said = ended.document
    assert said["conclusion"] in {one.value for one in NOT_REJECTED}
    assert said["test"]["nulls"].endswith(
        "carried along the recordings' own ways from other instants on"
    )
    assert "own ways from other instants on" in (tmp_path / "loop" / "report.html").read_text(
        encoding="utf-8"
    )
    # Recipes of the simulator hold cloth still.
    assert sorted(path.name for path in (tmp_path / "loop").iterdir()) == [
        "report.html",
        "verdict.json",
    ]
