"""Materials: the catalog, and what is refused."""

from __future__ import annotations

import json
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from flagdata.errors import InputError, UnknownNameError
from sim.cloth import material
from sim.cloth.material import Material
from tests.refusals import unrefused

DRAPED = {"cotton-59", "cotton-114", "cotton-192", "wool-274"}


def test_catalog_has_ten_cloths_with_tables_four_with_drapes_paper_and_aluminium() -> None:
    found = material.MATERIALS.names()
    assert len(found) == 16
    assert {"paper", "aluminium", "camel-ponte-roma", "11oz-black-denim", *DRAPED} <= set(found)
    for name in found:
        assert material.named_material(name).source


def test_camel_ponte_roma_has_the_published_numbers() -> None:
    # Runia et al. 2020, supplement, listing of the material file (cut to 1e-10 N·m); area weight as
    # measured.
    cloth = material.named_material("camel-ponte-roma")
    assert cloth.area_weight == 0.284
    np.testing.assert_allclose(
        cloth.bending[0],
        [36.3483e-6, 49.5855e-6, 45.7440e-6, 47.4133e-6, 20.7266e-6],
        rtol=0,
        atol=1e-10,
    )
    np.testing.assert_allclose(cloth.stretching[2], [67.368431, 77.767944, 182.273407, -14.661531])


@pytest.mark.reference
def test_catalog_agrees_with_the_distributed_files(reference_data: Path) -> None:
    for name in set(material.MATERIALS.names()) - DRAPED:
        text = (reference_data / "materials" / f"{name}.json").read_text(encoding="utf-8")
        content = json.loads(re.sub(r"//.*", "", text))
        cloth = material.named_material(name)
        assert cloth.area_weight == content["density"]
        np.testing.assert_array_equal(cloth.stretching, content["stretching"])
        np.testing.assert_array_equal(cloth.bending, content["bending"])


def test_a_fingerprint_depends_on_mass_and_stiffness_alone() -> None:
    cloth = material.named_material("camel-ponte-roma")
    assert replace(cloth, name="another", source="", damping=5e-3).fingerprint == cloth.fingerprint
    others = [cloth.scaled(**{what: 1.01}) for what in ("area_weight", "stretching", "bending")]
    assert len({cloth.fingerprint, *(other.fingerprint for other in others)}) == 4
    # Of the numbers, not of the object: as after a trip through a file.
    again = Material(
        name="again",
        source="",
        area_weight=float(str(cloth.area_weight)),
        stretching=cloth.stretching.copy(),
        bending=cloth.bending.copy(),
    )
    assert again.fingerprint == cloth.fingerprint


def test_thicker_cloth_is_heavier_and_stiffer_by_the_same_factor() -> None:
    thin = material.named_material("gray-interlock")
    thick = thin.scaled(area_weight=2, stretching=2, bending=2)
    assert thick.area_weight == 2 * thin.area_weight
    np.testing.assert_allclose(thick.stretching, 2 * thin.stretching)
    np.testing.assert_allclose(thick.bending, 2 * thin.bending)
    assert thick.damping == thin.damping


def test_impossible_materials_are_refused_with_the_reason() -> None:
    cases = [
        ({"area_weight": -0.1}, "area weight"),
        ({"area_weight": float("nan")}, "area weight"),
        ({"damping": -1.0}, "damping"),
        ({"area_weight": 155.0}, "155 kg/m² is above 20"),
        ({"stretching": np.zeros((5, 4))}, "stretching"),
        ({"bending": -np.ones((3, 5))}, "bending"),
        ({"bending": np.full((3, 5), np.inf)}, "bending"),
        ({"stretching": -np.ones((6, 4))}, "stiffness"),
        ({"stretching": [["a"] * 4] * 6}, "numbers"),
    ]
    assert not unrefused(
        lambda change: replace(material.named_material("paper"), **change), cases, InputError
    )


def test_unknown_and_missing_keys_are_named() -> None:
    content = {
        "source": "x",
        "area-weight": 0.1,
        "stretching": np.ones((6, 4)),
        "bending": np.ones((3, 5)),
    }
    with pytest.raises(InputError, match="colour"):
        Material.from_mapping({**content, "colour": "red"}, name="x")
    with pytest.raises(InputError, match="area-weight"):
        Material.from_mapping({k: v for k, v in content.items() if k != "area-weight"}, name="x")
    with pytest.raises(InputError, match="must be a number"):
        Material.from_mapping({**content, "area-weight": "0.1"}, name="x")


def test_unknown_material_suggests_the_nearest() -> None:
    with pytest.raises(UnknownNameError, match="camel-ponte-roma"):
        material.named_material("camel-ponte-rom")
