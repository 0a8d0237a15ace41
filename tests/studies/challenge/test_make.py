"""A sealed challenge gives away nothing but the data, and is the same each time it is made."""

from __future__ import annotations

import json
import math
from collections import Counter
from collections.abc import Sequence
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

from flagdata.core.provenance import file_hash
from flagdata.core.rng import stream
from flagdata.errors import ConflictError, CorruptError, InputError, UnknownNameError
from tests.studies.challenge import cases
from tests.studies.challenge import make as making
from tests.studies.challenge.answer_key import AnswerKey, opened, seal
from tests.studies.challenge.cases import TINY
from tests.studies.challenge.classes import class_of
from tests.studies.challenge.design import composition, draw
from tests.studies.challenge.folder import ChallengeFolder
from tests.studies.challenge.meshes import layout, mesh_of, seen
from tests.studies.challenge.recipe import CHALLENGES, ChallengeRecipe, Kind, load, parse
from tests.studies.challenge.simulation import SimulatedSet, batches


def tree(folder: Path) -> dict[str, str]:
    return {
        str(p.relative_to(folder)): file_hash(p) for p in sorted(folder.rglob("*")) if p.is_file()
    }


def test_the_same_seed_gives_the_same_bytes(tiny_source: Path, make_tiny, tmp_path: Path) -> None:
    assert tree(make_tiny(tmp_path / "again").path) == tree(tiny_source)


def test_one_that_was_stopped_goes_on_with_the_batches_that_it_lacks(
    tiny_source: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    simulated: list[int] = []
    one_by_one = lambda keys, recordings: [(key,) for key in keys]  # noqa: E731
    monkeypatch.setattr(making, "batches", one_by_one)
    plain = making.simulate

    def counted(
        recipe: ChallengeRecipe, seed: int, keys: Sequence[AnswerKey]
    ) -> dict[str, SimulatedSet]:
        if len(simulated) == 2:
            raise KeyboardInterrupt
        simulated.append(len(keys))
        return plain(recipe, seed, keys)

    monkeypatch.setattr(making, "simulate", counted)
    recipe = parse(TINY, where="tiny")
    with pytest.raises(KeyboardInterrupt):
        making.make(tmp_path / "tiny", recipe, seed=3, count=4)
    assert not (tmp_path / "tiny").exists()
    again: list[int] = []
    monkeypatch.setattr(
        making, "simulate", lambda r, seed, keys: again.append(len(keys)) or plain(r, seed, keys)
    )
    found: list[int] = []
    made = making.make(tmp_path / "tiny", recipe, seed=3, count=4, progress=found.append)
    assert (simulated, again, sum(found)) == ([1, 1], [1, 1], 4)
    assert [path.name for path in tmp_path.iterdir()] == ["tiny"]
    for name in made.names():
        made.seal(name)
        made.checked(name)


def test_a_challenge_that_cannot_be_made_leaves_nothing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def diverging(
        recipe: ChallengeRecipe, seed: int, keys: Sequence[AnswerKey]
    ) -> dict[str, SimulatedSet]:
        raise InputError("the cloth diverged", where="set-001", fix="narrow the recipe's ranges")

    monkeypatch.setattr(making, "simulate", diverging)
    with pytest.raises(InputError, match="diverged"):
        making.make(tmp_path / "tiny", parse(TINY, where="tiny"), seed=3, count=4)
    assert not list(tmp_path.iterdir())


def test_another_seed_gives_other_sets(tiny_source: Path, make_tiny, tmp_path: Path) -> None:
    other = tree(make_tiny(tmp_path / "other", seed=4).path)
    assert not {h for n, h in other.items() if n.endswith(".npy")} & set(tree(tiny_source).values())


def test_published_hashes_are_those_of_data_and_keys(tiny: ChallengeFolder) -> None:
    for name, entry in tiny.manifest()["sets"].items():
        tiny.checked(name)
        key = opened(tiny.seal(name), entry["commitment"], where=name)
        assert key.name == name


def test_a_key_whose_hash_was_not_published_is_refused(tiny: ChallengeFolder) -> None:
    content = tiny.seal("set-001")
    content["key"]["damping"] *= 1.01
    with pytest.raises(CorruptError, match="not the one whose hash was published"):
        opened(content, tiny.manifest()["sets"]["set-001"]["commitment"], where="set-001")


def test_a_seal_depends_on_the_salt_and_a_key_survives_json() -> None:
    key = cases.key("set-001", Kind.ONE, cases.acting("lift"))
    assert seal(key, "a") != seal(key, "b")
    assert AnswerKey.from_dict(json.loads(json.dumps(key.as_dict()))) == key


def test_data_that_were_changed_are_refused(tiny: ChallengeFolder) -> None:
    path = tiny.data("set-002") / "a.npy"
    track = np.load(path)
    track[0, 0, 0] += 1e-3
    np.save(path, track)
    with pytest.raises(CorruptError, match="not those that were published"):
        tiny.experiment("set-002")


def test_a_set_does_not_state_what_acts_in_it(tiny: ChallengeFolder) -> None:
    """No word of the keys, the same files, sizes by frame rate alone, one time of change."""
    public = (
        "".join((tiny.data(name) / "set.json").read_text() for name in tiny.names())
        + tiny.public.read_text()
    )
    for word in (
        "lift",
        "shear",
        "tether",
        "null",
        "pair",
        "outside",
        "only",
        "seed",
        "damping",
        "impact",
    ):
        assert word not in public
    sizes: dict[int, set[int]] = {}
    for name in tiny.names():
        folder = tiny.data(name)
        assert {p.name for p in folder.iterdir()} == {"set.json", "markers.npy", "a.npy", "b.npy"}
        rate = json.loads((folder / "set.json").read_text())["rate"]
        sizes.setdefault(rate, set()).add((folder / "a.npy").stat().st_size)
    assert all(len(found) == 1 for found in sizes.values())


def test_files_of_all_sets_have_one_time_of_change(tiny_source: Path) -> None:
    assert len({p.stat().st_mtime for p in (tiny_source / "sets").rglob("*.*")}) == 1


def test_a_set_reads_as_an_experiment_on_the_fitters_own_mesh(tiny: ChallengeFolder) -> None:
    experiment = tiny.experiment("set-001")
    assert experiment.specimen.mesh.vertex_count == 16 * 11
    assert len(experiment.recordings) == 2
    for recording in experiment.recordings:
        # Within 0.4 s from rest nothing has moved by more than the flag's length; pins are where
        # markers start.
        distance = np.linalg.norm(recording.positions - experiment.specimen.anchors[0], axis=2)
        assert distance.max() < 2.0
        assert recording.positions.shape == (round(0.2 * recording.rate), 30, 3)


def test_a_folder_that_is_not_empty_is_left_alone(tiny: ChallengeFolder, make_tiny) -> None:
    with pytest.raises(ConflictError, match="exists"):
        make_tiny(tiny.path)


def test_the_standard_challenge_has_the_composition_it_is_to_have() -> None:
    recipe = load("standard")
    keys = draw(recipe, seed=1, count=60)
    kinds = Counter(key.kind for key in keys)
    assert kinds[Kind.NULL] >= 20
    assert kinds[Kind.PAIR] >= 6
    assert len({key.effects[0].effect for key in keys if key.kind is Kind.OUTSIDE}) >= 8
    assert len({key.effects[0].effect for key in keys if key.kind is Kind.ONE}) >= 8
    assert all(np.diff(sorted(key.speeds)).min() >= recipe.apart - 1e-9 for key in keys)
    assert {key.rate for key in keys} == {25, 60}
    assert {key.noise for key in keys} == {0.0, 0.001, 0.004}
    pairs = [[class_of(a.effect) for a in key.effects] for key in keys if key.kind is Kind.PAIR]
    assert all(first != second for first, second in pairs)
    assert sorted(key.name for group in batches(keys, 3) for key in group) == [
        key.name for key in keys
    ]


def test_names_are_in_no_order_of_kind() -> None:
    """The kinds along the names of 400 sets: neighbours agree as often as independent draws do."""
    keys = draw(load("standard"), seed=2, count=400)
    share = np.array(list(Counter(key.kind for key in keys).values())) / 400
    agree = np.mean([a.kind == b.kind for a, b in pairwise(keys)])
    # Standard deviation of a share of 0.28 among 399: 0.023; four of them.
    assert abs(agree - (share**2).sum()) < 0.09


@pytest.mark.parametrize("count", [1, 4, 7, 60])
def test_shares_are_dealt_out_to_within_one(count: int) -> None:
    recipe = load("standard")
    dealt = composition(recipe, count)
    assert sum(dealt.values()) == count
    total = sum(recipe.composition.values())
    assert all(
        abs(dealt[kind] - count * share / total) < 1 for kind, share in recipe.composition.items()
    )


def test_markers_follow_a_smooth_surface_to_the_order_of_cubic_splines() -> None:
    """x = cos(4u) sin(5v): error of h⁴ between meshes; a marker on a vertex is that vertex."""
    recipe = load("standard")
    markers = layout(recipe, stream(1, "markers"))

    def error(name: str) -> float:
        numerics = recipe.numerics[name]
        mesh = mesh_of(numerics, width=1.5, height=1.0)
        field = np.cos(4 * mesh.rest[:, 0]) * np.sin(5 * mesh.rest[:, 1])
        weights = seen(numerics, markers, width=1.5, height=1.0)
        return float(
            np.abs(weights @ field - np.cos(4 * markers[:, 0]) * np.sin(5 * markers[:, 1])).max()
        )

    # h⁴ f''''/384 with h = 75 mm and f'''' = 5⁴: 5e-5, five times that at not-a-knot ends.
    assert error("coarse") < 3e-4
    assert error("fine") < error("coarse")
    numerics = recipe.numerics["coarse"]
    mesh = mesh_of(numerics, width=1.5, height=1.0)
    np.testing.assert_allclose(
        seen(numerics, mesh.rest, width=1.5, height=1.0), np.eye(len(mesh.rest)), atol=1e-12
    )


def test_markers_lie_on_the_cloth_and_not_on_the_fitters_vertices(tiny: ChallengeFolder) -> None:
    recipe = load("standard")
    markers = layout(recipe, stream(1, "markers"))
    assert markers.min() >= 0
    assert (markers.max(axis=0) <= [recipe.width, recipe.height]).all()
    inner = markers[(markers > 0.05).all(axis=1) & (markers < [1.45, 0.95]).all(axis=1)]
    rest = tiny.experiment("set-001").specimen.mesh.rest
    nearest = np.linalg.norm(inner[:, None] - rest, axis=2).min(axis=1)
    assert np.median(nearest) > 0.01


@pytest.mark.parametrize(
    ("old", "new", "error"),
    [
        ("[composition]", "[compositoin]", UnknownNameError),
        ("camel-ponte-roma", "camel-ponte", UnknownNameError),
        ("[effects.lift]", "[effects.lfit]", UnknownNameError),
        ('parameter = "stiffness"', 'parameter = "length"', UnknownNameError),
        ("apart = 1.5", "apart = 9.0", InputError),
        ("rates = [25, 60]", "rates = [25.5]", InputError),
        ("rates = [25, 60]", "rates = []", InputError),
        ('diagonals = "forward"', 'integrator = "implicit"', InputError),
        ('diagonals = "forward"', "step = 0.001", InputError),
        ("[effects.shear]\nrange = 0.4", "", InputError),
        (
            "[effects.shear]\nrange = 0.4",
            "[effects.shear]\nrange = 0.4\nvalues = [0.2]",
            InputError,
        ),
        ("[effects.shear]\nrange = 0.4", "[effects.shear]\nvalues = [0.2, 0.0]", InputError),
    ],
)
def test_recipes_that_make_no_sense_are_refused(old: str, new: str, error: type[Exception]) -> None:
    assert old in TINY
    with pytest.raises(error):
        parse(TINY.replace(old, new), where="tiny")


def test_strengths_that_are_fixed_beforehand_are_dealt_out_evenly() -> None:
    recipe = load("registered")
    keys = draw(recipe, seed=5, count=96)
    alone: dict[str, list[float]] = {}
    for key in keys:
        if key.kind is Kind.ONE:
            alone.setdefault(key.effects[0].effect, []).append(abs(key.effects[0].value))
    assert {name: sorted(values) for name, values in alone.items()} == {
        name: sorted(strengths.values) for name, strengths in recipe.effects.items()
    }
    beside = {
        (a.effect, abs(a.value)) for key in keys if key.kind is Kind.PAIR for a in key.effects
    }
    assert beside <= {
        (name, value) for name, strengths in recipe.effects.items() for value in strengths.values
    }
    assert len({value for _, value in beside}) > len(
        {name for name, _ in beside}
    )  # neither the first nor the last alone
    outside = Counter(key.effects[0].effect for key in keys if key.kind is Kind.OUTSIDE)
    assert set(outside.values()) == {3}
    assert len(outside) == 10


def test_sets_are_dealt_out_among_designs_each_of_one_cloth_rate_and_noise() -> None:
    recipe = load("registered-designs")
    keys = draw(recipe, seed=5, count=96)
    of_designs = Counter((key.material, key.rate, key.noise) for key in keys)
    assert of_designs == {
        (one.material, one.rate, one.noise): 16 for one in recipe.designs.values()
    }
    nulls = Counter(key.material for key in keys if key.kind is Kind.NULL)
    assert set(nulls.values()) <= {4, 5}
    for key in keys:
        assert (key.intensity > 0) == (key.material == "11oz-black-denim")
    # Half are of a stated weight, from which a cloth differs by the error of the scale.
    weighed = [
        math.log(key.density)
        for key in keys
        if recipe.weight_sigma(material=key.material, rate=key.rate, noise=key.noise)
    ]
    assert len(weighed) == 48
    assert 0.02 < float(np.std(weighed)) < 0.04
    others = [key.density for key in keys if key.material == "white-swim-solid"]
    assert all(0.8 <= density <= 1.25 for density in others)
    assert float(np.std(np.log(others))) > 0.06


def test_the_weight_of_a_design_is_stated_beside_its_sets(tmp_path: Path) -> None:
    designed = TINY.replace('materials = ["camel-ponte-roma"]\n', "")
    designed = designed.replace("rates = [25, 60]\nnoises = [0.0, 0.001]\n", "")
    designed = designed.replace("share = 0.5\n", "")
    weighed = """
[designs.only]
material = "camel-ponte-roma"
rate = 25
noise = 0.001
weight-sigma = 0.03
"""
    recipe = parse(designed + weighed, where="tiny")
    made = making.make(tmp_path / "weighed", recipe, seed=3, count=1)
    assert made.experiment("set-001").specimen.area_weight_uncertainty == 0.03
    for wrong, message in (
        (TINY + weighed, "designs and materials"),
        (designed.replace("rate = 10\n", "rate = 10\nshare = 0.5\n") + weighed, "beside films"),
    ):
        with pytest.raises(InputError, match=message):
            parse(wrong, where="tiny")


def test_the_catalogs_recipes_parse() -> None:
    assert CHALLENGES.names() == (
        "films",
        "films-3",
        "films-long",
        "inertia",
        "registered",
        "registered-designs",
        "standard",
        "strong",
    )
    assert [load(name).count for name in CHALLENGES.names()] == [3] * 8
