"""Drapes measured, simulated, and what cloth they are of."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner, Result

import flagdata
from flagdata.core.arrays import FloatArray
from flagdata.core.findings import Finding
from flagdata.core.stated import Stated
from flagdata.errors import InputError, RefusedError, UsageError
from measure.commands.calibrate import calibrate
from measure.drape import (
    DrapeBatch,
    Face,
    Model,
    Surface,
    answer_of,
    fit_drapes,
    material,
    ratio,
    rim_of,
    shape_of,
)
from sim.cloth.mesh import Mesh
from sim.run.cusick_drape import disc
from tests.golden_answers import changes
from tests.measure.drape.conftest import COUNT, NOISE, scan, shapes, simulated

G = 9.81


def test_a_flat_disc_covers_its_border_and_has_no_folds() -> None:
    mesh = disc(np.random.default_rng(0), rows=5)
    flat = np.concatenate([mesh.rest, np.zeros((mesh.vertex_count, 1))], axis=1)
    seen = shape_of(mesh, flat)
    assert seen.coefficient == pytest.approx(1.0, abs=0.003)  # a polygon of 81 corners
    assert abs(seen.lobe) + seen.folding + abs(seen.height) < 1e-6
    assert seen.area == pytest.approx(1.0)


def test_folds_lobes_and_drape_coefficient_are_those_that_were_made() -> None:
    made = scan(0.6, lobe=0.03)
    position = made.positions - np.array([1.0, 2.0, 0.3])
    rest = (made.rest - 5.0) / 10
    flat = Mesh(rest=rest, faces=made.faces)
    seen = shape_of(flat, position, rim=rim_of(flat))
    assert seen.coefficient == pytest.approx(0.6, abs=0.006)
    assert seen.folds == 7
    assert seen.folding == pytest.approx(0.004 / np.sqrt(2), rel=0.03)
    assert seen.lobe == pytest.approx(0.03, abs=5e-4)
    turned = rest @ np.array(
        [[0.0, 1.0], [-1.0, 0.0]]
    )  # the flat cloth by 90°, so that its lobe is along v
    assert shape_of(Mesh(rest=turned, faces=made.faces), position).lobe == pytest.approx(
        -0.03, abs=5e-4
    )


def test_stiffer_warp_bends_less_along_the_warp() -> None:
    assert ratio(0.0) == pytest.approx(1.0)
    assert ratio(0.6) == pytest.approx(1 / ratio(-0.6))
    assert ratio(0.6) > 1.8
    cloth = material(0.02, 0.0, 300.0)
    assert cloth.bending[0, 0] == pytest.approx(4 * 0.02**3 * cloth.area_weight * G, rel=1e-3)


def test_a_batch_is_simulated_and_measured_and_a_stiffer_warp_makes_a_lobe_along_it() -> None:
    values = {
        "bending_length": np.array([0.02, 0.02]),
        "anisotropy": np.array([1.2, -1.2]),
        "shear": np.array([300.0, 300.0]),
        "rest_curvature": np.array([0.0, 0.0]),
    }
    batch = DrapeBatch(values=values, seeds=(1, 1), rows=4)
    along, across = batch.read()
    assert along[1] > 0.02
    assert across[1] < -0.02
    assert 0.5 < along[0] < 0.85  # Cusick's discs of this bending length lie between
    assert batch.content()["seeds"] == [1, 1]


def faces_of(
    seed: int, *, length: float = 0.02, curvature: float = 0.0, sidedness: float = 0.0
) -> list[Face]:
    rng = np.random.default_rng(seed)
    made = []
    for sign in (1.0, -1.0):
        values = {
            "bending_length": np.full(8, length * np.exp(sign * sidedness)),
            "anisotropy": np.full(8, 0.5),
            "shear": np.full(8, 400.0),
            "rest_curvature": np.full(8, sign * curvature),
        }
        made.append(Face(shapes=shapes(values, rng), specimen=np.arange(8)))
    return made


@pytest.fixture(scope="module")
def surface() -> Surface:
    return Surface.fit(*simulated(COUNT, seed=0))


def test_a_surface_finds_the_function_that_made_it(surface: Surface) -> None:
    assert surface.residual == pytest.approx(NOISE, rel=0.3)
    values, _ = simulated(64, seed=5)
    noiseless = (
        0.7 + 0.55 * np.log(values["bending_length"] / 0.02) + 0.03 * np.log(values["shear"] / 400)
    )
    noiseless += 0.0007 * values["rest_curvature"]
    found, variance = surface.at(values)
    assert np.abs(found[:, 0] - noiseless).max() < 5 * np.sqrt(variance[:, 0].max())


def test_the_bending_length_and_the_stiffer_thread_are_found(surface: Surface) -> None:
    found = fit_drapes(surface, faces_of(1)[:1], model=Model.BASE, seed=0)
    low, high = np.quantile(found.cloth["bending_length"], [0.05, 0.95])
    assert low < 0.02 < high
    assert (
        high / low < 1.25
    )  # shear within a factor of 8 makes 0.06 of the drape coefficient, a tenth of a length
    assert np.median(found.cloth["anisotropy"]) == pytest.approx(0.5, abs=0.3)
    assert found.tail > 0.01


@pytest.mark.parametrize(
    ("truth", "named", "other"),
    [
        ({"curvature": 12.0}, Model.CURLED, Model.SIDED),
        ({"sidedness": 0.06}, Model.SIDED, Model.CURLED),
    ],
)
def test_lobes_distinguish_what_differs_between_faces(
    surface: Surface, truth: dict[str, float], named: Model, other: Model
) -> None:
    faces = faces_of(2, **truth)
    base = fit_drapes(surface, faces, model=Model.BASE, seed=0).evidence
    gain = {
        model: fit_drapes(surface, faces, model=model, seed=0).evidence - base for model in Model
    }
    assert gain[named] > 3
    assert gain[named] > gain[other]
    # What is the same on both faces cannot make them differ.
    assert gain[Model.WET] < 1
    assert gain[Model.ALIKE] < 1
    if named is Model.CURLED:
        signs = [
            np.sign(
                np.median(fit_drapes(surface, pair, model=named, seed=0).cloth["rest_curvature"])
            )
            for pair in (faces, faces[::-1])
        ]
        assert signs == [1.0, -1.0]


def test_one_drape_is_no_sample(surface: Surface) -> None:
    alone = faces_of(1)[0].of([0])
    with pytest.raises(InputError, match="two pieces of cloth"):
        fit_drapes(surface, [alone], model=Model.BASE, seed=0)


def _run(*arguments: str | Path) -> Result:
    return CliRunner().invoke(calibrate, [str(one) for one in arguments])


@pytest.mark.usefixtures("cheap")
def test_folders_of_scans_give_bending_on_the_command_line_and_in_python(
    scanned: Callable[..., Path],
) -> None:
    rng = np.random.default_rng(0)
    up = scanned("up", 0.7 + 0.02 * rng.standard_normal(6))
    done = _run(up, "--area-weight", "0.2±0.004", "--json")
    assert done.exit_code == 0, done.output
    found = json.loads(done.stdout)
    assert found["schema"] == "flagdata.calibrate/1"
    assert changes("drape", found, relative=1e-5) == []
    assert found["drapes"][0]["count"] == 6
    assert found["drapes"][0]["drape_coefficient"] == pytest.approx(0.7, abs=0.03)
    low, high = found["cloth"]["bending"]["interval"]
    assert low < 0.02**3 * 0.2 * G < high
    text = _run(up, "--area-weight", "0.2±0.004")
    assert text.stdout.startswith("bending ")
    answer = flagdata.calibrate(up, area_weight="0.2±0.004")
    assert answer.quantities["bending"].interval == pytest.approx((low, high))


def test_faces_that_drape_differently_are_reported(surface: Surface) -> None:
    def findings(faces: list[Face]) -> dict[str, Finding]:
        return {
            one.kind: one
            for one in answer_of(surface, faces, Stated.of(0.2), level=0.9, seed=0).findings
        }

    finding = findings(faces_of(2, sidedness=0.06))["faces-drape-differently"]
    assert finding.value == pytest.approx(-2 * 0.06 * 0.55, abs=0.01)
    assert "rest curvature does not explain it" in finding.what
    assert (
        "rest curvature explains it"
        in findings(faces_of(2, curvature=12.0))["faces-drape-differently"].what
    )
    assert findings(faces_of(2)) == {}


@pytest.mark.usefixtures("cheap")
def test_cloth_that_no_simulated_one_drapes_like_is_refused(scanned: Callable[..., Path]) -> None:
    limp: FloatArray = np.array([0.02, 0.021, 0.019])
    with pytest.raises(RefusedError, match="no simulated cloth drapes"):
        flagdata.calibrate(scanned("limp", limp), area_weight=0.2)


@pytest.mark.usefixtures("cheap")
@pytest.mark.parametrize(
    ("arguments", "match"),
    [
        (("up", "--area-weight", "0"), "the area weight is 0"),
        (
            ("up", "--area-weight", "0.2", "--flag-size", "1x1"),
            "--flag-size cannot be combined with --area-weight",
        ),
        (("film.mp4", "--area-weight", "0.2"), "no folder of drapes"),
        (("up", "up", "up", "--area-weight", "0.2"), "3 folders of drapes"),
    ],
)
def test_what_drapes_cannot_be_is_refused(
    scanned: Callable[..., Path],
    monkeypatch: pytest.MonkeyPatch,
    arguments: tuple[str, ...],
    match: str,
) -> None:
    monkeypatch.chdir(scanned("up", np.array([0.7, 0.71])).parent)
    done = _run(*arguments)
    assert isinstance(done.exception, UsageError)
    assert match in str(done.exception)
