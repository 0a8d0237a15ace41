"""Experiments drawn for MuJoCo, and how verdicts on them are graded."""

from __future__ import annotations

from pathlib import Path
from types import MappingProxyType

import numpy as np
import pytest
import torch

from measure.trajectories import parse
from measure.verdict import Conclusion
from sim.cloth import Cloth
from sim.cloth.material import named_material
from sim.cloth.membrane import energy as stretching
from sim.cloth.mesh import grid
from sim.effects import HemMass
from tests.studies.validation import foreign
from tests.studies.validation.mujoco import experiments
from tests.studies.validation.mujoco.experiments import (
    DAMPINGS,
    NOMINAL,
    NOTHING,
    SPREAD,
    UNDECLARED,
    Truth,
    draw,
)

MATERIAL = named_material("camel-ponte-roma")
TRUTHS = [draw(f"null-{k}", NOTHING, seed=3) for k in range(40)]


def test_cloths_differ_from_the_declared_one_within_their_spread() -> None:
    for name, (low, high) in SPREAD.items():
        factors = np.array([truth.factors[name] for truth in TRUTHS])
        assert low <= factors.min()
        assert factors.max() <= high
        assert np.log(factors).std() > 0.5 * np.log(high / low) / np.sqrt(
            12
        )  # half of a uniform's, of 40
    dampings = np.array([truth.sheet.damping for truth in TRUTHS])
    assert DAMPINGS[0] <= dampings.min()
    assert dampings.max() <= DAMPINGS[1]
    assert len({truth.method for truth in TRUTHS}) == 3
    assert len({truth.diagonals for truth in TRUTHS}) == 2


def test_the_winds_are_one_from_each_third_and_an_experiment_is_drawn_by_its_name() -> None:
    low, high = experiments.SPEEDS
    for truth in TRUTHS:
        thirds = [int(3 * (speed - low) / (high - low)) for speed in truth.speeds]
        assert thirds == [0, 1, 2]
    assert draw("null-0", NOTHING, seed=3).speeds == TRUTHS[0].speeds != TRUTHS[1].speeds


def test_the_declared_material_has_the_membrane_of_saint_venant_and_kirchhoff(
    tmp_path: Path,
) -> None:
    """(E t/(1 − ν²)) [(ε00 + ε11)² − 2 (1 − ν)(ε00 ε11 − ε01²)]/2 for each area (Timoshenko, Theory
    of Plates)."""
    (tmp_path / "cloth.toml").write_text(experiments.material_text(), encoding="utf-8")
    (tmp_path / "recipe.toml").write_text('[material]\nfile = "cloth.toml"\n', encoding="utf-8")
    material = parse(tmp_path / "recipe.toml").setup.material
    assert material is not None
    assert material.area_weight == NOMINAL.area_weight
    mesh = grid(width=1.0, height=1.0, columns=2, rows=2)
    cloth = Cloth.build(mesh, [material], dtype=torch.float64)
    y, nu = NOMINAL.stretching, NOMINAL.poisson
    for gradient in (
        [[1.02, 0.0], [0.0, 1.0]],
        [[1.01, 0.0], [0.0, 1.03]],
        [[1.0, 0.02], [0.02, 1.0]],
    ):
        f = np.array(gradient)
        strain = (f.T @ f - np.eye(2)) / 2
        expected = (
            y / (1 - nu**2) * (np.trace(strain) ** 2 - 2 * (1 - nu) * np.linalg.det(strain)) / 2
        )
        position = np.concatenate([mesh.rest @ f.T, np.zeros((9, 1))], axis=1)[..., None]
        found = float(stretching(cloth, torch.as_tensor(position))[0])
        assert found == pytest.approx(expected, rel=1e-5)


def test_a_hem_weighs_its_line_density_times_the_circumference() -> None:
    truth = draw("hem-0", UNDECLARED["hem"], seed=1)
    assert truth.sheet.added is not None
    assert truth.sheet.added.sum() == pytest.approx(0.02 * 2 * (1.5 + 1.0))
    mass = (
        HemMass(line_density=0.02)
        .cloth(Cloth.build(truth.sheet.mesh, [MATERIAL], dtype=torch.float64))
        .mass[:, 0]
    )
    plain = MATERIAL.area_weight * truth.sheet.mesh.vertex_areas
    np.testing.assert_allclose(truth.sheet.added, mass.numpy() - plain, atol=1e-12)


@pytest.mark.parametrize(
    ("acted", "conclusion", "named", "expected"),
    [
        ("", Conclusion.SUFFICIENT, (), "right"),
        ("", Conclusion.OUTSIDE, (), "wrong"),
        ("", Conclusion.UNDECIDED, (), "undecided"),
        ("pressure", Conclusion.UNDECIDED, (), "undecided"),
        ("magnus", Conclusion.UNDECIDED, (), "undecided"),
        ("pressure", Conclusion.EFFECT, ("air-density",), "right"),
        ("pressure", Conclusion.ONE_OF, ("lift", "air-density"), "among"),
        ("pressure", Conclusion.PARTLY, ("air-density",), "partly"),
        ("pressure", Conclusion.EFFECT, ("porosity",), "class"),
        ("pressure", Conclusion.EFFECT, ("lift",), "wrong"),
        ("pressure", Conclusion.SUFFICIENT, (), "wrong"),
        ("damping", Conclusion.SUFFICIENT, (), "right"),
        ("damping", Conclusion.OUTSIDE, (), "wrong"),
        ("magnus", Conclusion.OUTSIDE, (), "right"),
        ("magnus", Conclusion.SUFFICIENT, (), "wrong"),
    ],
)
def test_verdicts_are_graded_by_what_acted(
    acted: str, conclusion: Conclusion, named: tuple[str, ...], expected: str
) -> None:
    truth = draw("one", UNDECLARED[acted] if acted else NOTHING, seed=1)
    assert foreign.grade(truth, conclusion, named) == expected


def test_the_summary_counts_nulls_and_effects_apart() -> None:
    rows = [_row(TRUTHS[k], 0.5 if k else 0.01, grade="right" if k else "wrong") for k in range(4)]
    rows += [
        _row(draw("p", UNDECLARED["pressure"], seed=1), 0.01, grade="right"),
        {**rows[0], "refused": "short"},
    ]
    rows[-1].pop("said")
    found = foreign.summary(rows)
    assert (found["false_rejections"]["hits"], found["false_rejections"]["count"]) == (1, 4)
    assert (found["right"]["hits"], found["right"]["count"], found["refused"]) == (1, 1, 1)
    assert found["covered"]["damping"]["hits"] == 5
    text = foreign.page({**found, "kinds": 8, "experiments": rows})
    assert "| nulls that were rejected | 0.25 | 1 of 4 |" in text
    assert "refused: short" in text


def _row(truth: Truth, p: float, *, grade: str) -> dict[str, object]:
    covered = MappingProxyType(
        {name: {"covers": True} for name in ("area_weight", "bending", "damping")}
    )
    return {
        "name": truth.name,
        "acted": truth.undeclared.title,
        "factors": dict(truth.factors),
        "damping": truth.damping,
        "method": "Euler",
        "said": "as it may be",
        "named": [],
        "p": p,
        "level": 0.03,
        "grade": grade,
        "parameters": covered,
    }
