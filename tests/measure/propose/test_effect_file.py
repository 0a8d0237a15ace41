"""A proposal's file is an effect like those of the library: it is loaded, and holds to the whole
contract."""

from __future__ import annotations

import os
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import torch

from flagdata.answer import Quantity
from flagdata.errors import NotFoundError, UsageError
from measure.propose import Decision, ProposalOutcome, Term, write
from measure.propose.candidates import from_file
from measure.propose.outcome import StrengthCourse, TermStrength
from measure.propose.terms import TermEffect
from sim.cloth.material import named_material
from sim.cloth.scene import assemble, flag
from sim.effects import apply, load

ROOT = Path(__file__).resolve().parents[3]


def proposal(**fitted: tuple[float, str]) -> ProposalOutcome:
    course = StrengthCourse(
        bin=0.2,
        times=[],
        amplitudes=[],
        by_recording=[],
        speeds=[],
        fluctuation=0.0,
        lines=[],
        words="",
    )
    strengths = tuple(
        TermStrength(
            name=name,
            words="a push",
            course=course,
            estimate=Quantity.of(value=value, low=value - 0.1, high=value + 0.1, unit=unit),
        )
        for name, (value, unit) in fitted.items()
    )
    return ProposalOutcome(
        decision=Decision.KEPT,
        reason="",
        steps=(),
        tried=6,
        ranking=(),
        strengths=strengths,
        retest=None,
        level=0.03,
        nulls="",
        proposed_from="ab12" * 16,
        tested_on="cd34" * 16,
        known=(),
        seed=0,
    )


@pytest.fixture
def two() -> ProposalOutcome:
    return proposal(upward_lower=(0.8, "m/s²"), toward_pole_lower_fly=(-1.5, "1/s²"))


@pytest.fixture
def heavy() -> ProposalOutcome:
    return proposal(
        mass_near_75_30=(2.0, "1"),
        mass_stripe_60=(0.5, "1"),
        left_of_motion_everywhere=(0.4, "1/s"),
    )


def test_a_proposal_that_was_changed_is_kept_and_the_new_one_gets_a_name_of_its_own(
    two: ProposalOutcome, heavy: ProposalOutcome, tmp_path: Path
) -> None:
    first = write(two, tmp_path).path
    assert write(heavy, tmp_path).path == first  # as it was written: replaced
    first.write_text("mine = 1\n")
    second = write(two, tmp_path)
    assert (first.name, second.path.name) == (
        "proposed_ab12ab12ab12.py",
        "proposed_ab12ab12ab12_2.py",
    )
    assert first.read_text() == "mine = 1\n"
    assert load(second.spec).strengths() == ("upward_lower", "toward_pole_lower_fly")
    assert "proposed_ab12ab12ab12_2:" in (tmp_path / "pyproject.toml").read_text()


def test_the_file_is_the_sum_of_its_terms(two: ProposalOutcome, tmp_path: Path) -> None:
    made = load(write(two, tmp_path).spec)
    assert made.strengths() == ("upward_lower", "toward_pole_lower_fly")
    assert made.parameters()["toward_pole_lower_fly"].unit == "1/s²"
    batch = assemble(
        [flag(material=named_material("camel-ponte-roma"), wind_speed=4.0, columns=6)],
        dtype=torch.float64,
    )
    terms = [
        TermEffect(term=Term(shape="lower", field="upward"), coefficient=0.8),
        TermEffect(term=Term(shape="lower_fly", field="toward_pole"), coefficient=-1.5),
    ]

    def force(system, state) -> np.ndarray:
        wind = system.wind.velocity(0.0)
        args = (system.cloth, 0.0, state.position, state.velocity, wind)
        return sum(effect.force(*args) for effect in system.effects).numpy()

    one = force(*apply([made(upward_lower=0.8, toward_pole_lower_fly=-1.5)], *batch))
    np.testing.assert_allclose(one, force(*apply(terms, *batch)), rtol=1e-12, atol=1e-15)


def test_mass_of_the_file_is_that_of_its_terms(tmp_path: Path) -> None:
    """Also where no force is beside it."""
    made = load(
        write(proposal(mass_near_75_30=(2.0, "1"), mass_stripe_60=(0.5, "1")), tmp_path).spec
    )
    batch = assemble(
        [flag(material=named_material("camel-ponte-roma"), wind_speed=4.0, columns=6)],
        dtype=torch.float64,
    )
    u, v = (batch[0].cloth.mesh.rest / batch[0].cloth.mesh.rest.max(axis=0)).T
    width, height = batch[0].cloth.mesh.rest.max(axis=0)
    square = 0.01 * width * height
    near = np.exp(-(((u - 0.75) * width) ** 2 + ((v - 0.3) * height) ** 2) / (2 * square))
    stripe = np.exp(-(((u - 0.6) * width) ** 2) / (2 * square))
    system, _ = apply([made(mass_near_75_30=2.0, mass_stripe_60=0.5)], *batch)
    ratio = (system.cloth.mass / batch[0].cloth.mass)[:, 0].numpy()
    np.testing.assert_allclose(ratio, 1 + 2 * near + 0.5 * stripe, rtol=1e-12)


def test_its_strengths_can_be_tested_on_other_recordings(
    two: ProposalOutcome, tmp_path: Path
) -> None:
    columns = from_file(write(two, tmp_path).spec)
    assert [column.parameter for column in columns] == ["upward_lower", "toward_pole_lower_fly"]
    # Half of the end of the prior farther from zero: the fit with the width of its interval.
    assert [column.step for column in columns] == pytest.approx([0.5, -0.85])
    assert columns[0].at(0.3).upward_lower == 0.3  # pyright: ignore[reportAttributeAccessIssue]


def test_its_own_contract_tests_and_the_librarys_pass(
    two: ProposalOutcome, heavy: ProposalOutcome, tmp_path: Path
) -> None:
    """Two files as if they were installed: entry points make them effects of the library."""
    outcomes = (two, replace(heavy, proposed_from="ef56" * 16))
    made = {
        f"proposed-{place}": write(outcome, tmp_path / str(place))
        for place, outcome in enumerate(outcomes)
    }
    info = tmp_path / "0" / "proposed-1.dist-info"
    info.mkdir()
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: proposed\nVersion: 1\n")
    points = [f"{name} = {own.path.stem}:{own.class_name}\n" for name, own in made.items()]
    (info / "entry_points.txt").write_text("".join(["[flagdata.effects]\n", *points]))
    folders = [str(own.path.parent) for own in made.values()]
    environment = {
        **os.environ,
        "PYTHONPATH": os.pathsep.join([*folders, str(ROOT)]),
        "OMP_NUM_THREADS": "1",
    }
    own_tests = [own.path.with_name(f"test_{own.path.name}") for own in made.values()]
    chosen = " or ".join([*made, *(path.stem for path in own_tests)])
    files = [*own_tests, ROOT / "tests/contract/test_effects.py"]
    done = subprocess.run(
        [
            sys.executable,
            "-m",
            "pytest",
            "-q",
            "-p",
            "no:cacheprovider",
            "-k",
            chosen,
            *map(str, files),
        ],
        cwd=ROOT,
        env=environment,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stdout[-4000:] + done.stderr[-1000:]
    passed = int(done.stdout.rsplit(" passed", 1)[0].split()[-1])
    # Of each file's own five and a gradient for each strength, and one for each law of the
    # library's contract.
    assert passed >= sum(5 + len(outcome.strengths) + 14 for outcome in outcomes)


@pytest.mark.parametrize(
    ("content", "named_class", "error"),
    [
        ("X = 1", "X", UsageError),
        ("X = 1", "Y", NotFoundError),
        ("raise ValueError('no')", "X", UsageError),
    ],
)
def test_what_is_no_effect_is_refused(
    content: str, named_class: str, error: type[Exception], tmp_path: Path
) -> None:
    path = tmp_path / "file.py"
    path.write_text(content)
    with pytest.raises(error):
        load(f"{path}:{named_class}")


def test_a_file_that_is_not_there_is_refused(tmp_path: Path) -> None:
    with pytest.raises(NotFoundError, match="no such file"):
        load(f"{tmp_path / 'none.py'}:X")
    with pytest.raises(UsageError, match=r"FILE\.py:Class"):
        load("file.py")


def test_an_outcome_without_terms_is_not_written(tmp_path: Path) -> None:
    with pytest.raises(UsageError, match="no term"):
        write(proposal(), tmp_path)
