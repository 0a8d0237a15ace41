"""A stated fabric: which measured tables its simulations draw, and that nothing else changes."""

from __future__ import annotations

from collections import Counter

import numpy as np
import pytest

from flagdata.errors import UnknownNameError
from measure.cloth import TABLES, CalibrationOptions, Design, Flag, Log, Observed, designs_of, nulls
from measure.cloth.flag_prior import CLASSES, fabric
from sim.cloth.material import named_material

FLAG = Flag(length=1.5, height=1.0)


def design(material: str | None, *, count: int = 64) -> Design:
    times = np.arange(-20.0, 22.0)
    log = Log(times=times, speed=5.0 + np.sin(times / 5), distance=3.0)
    made_of = None if material is None else fabric(material, where="--material")
    options = CalibrationOptions(flag=FLAG, simulations=count, seed=3, material=made_of)
    (found,) = designs_of(
        [Observed(name="monday", source="a", readings=np.zeros((8, 8)), log=log)], options
    )
    return found


def tables(design: Design) -> Counter[str]:
    return Counter(TABLES[int(own * len(TABLES))] for own in design.values()["fabric"])


@pytest.mark.parametrize("name", [*CLASSES, "camel-ponte-roma"])
def test_a_stated_fabric_draws_its_tables_evenly_and_leaves_all_else(name: str) -> None:
    stated, plain = design(name), design(None)
    drawn, own = tables(stated), fabric(name, where="").tables
    assert set(drawn) == set(own)
    assert max(drawn.values()) - min(drawn.values()) <= 2 * len(own)
    assert set(tables(plain)) == set(TABLES)
    for quantity, values in plain.values().items():
        assert np.array_equal(values, stated.values()[quantity]) == (quantity != "fabric"), quantity


def test_null_flags_are_of_the_stated_fabric() -> None:
    made = nulls([design("woven")], [0], kinds=5, seed=3)
    drawn = {TABLES[int(own * len(TABLES))] for batch in made[0] for own in batch.values["fabric"]}
    assert drawn == set(CLASSES["woven"])


def test_simulations_of_any_fabric_are_the_ones_that_were_kept() -> None:
    """Their hash has no word of a material that was not stated."""
    plain = design(None).batches()[0].content()
    assert "material" not in plain
    assert "material" not in CalibrationOptions(flag=FLAG).recipe()
    assert (
        CalibrationOptions(flag=FLAG, material=fabric("knit", where="")).recipe()["material"]
        == "knit"
    )


def test_woven_cloths_are_the_ones_that_hardly_stretch() -> None:
    """At rest, along warp and weft, as the classes' rule has it."""
    least = {name: float(named_material(name).stretching[0, [0, 2]].min()) for name in TABLES}
    assert {name for name, own in least.items() if own >= 200} == set(CLASSES["woven"])
    assert {name for name, own in least.items() if own < 100} == set(CLASSES["knit"])
    assert {name for name in least if 100 <= least[name] < 200} == {"pink-ribbon-brown"}


def test_an_unknown_fabric_is_refused_with_all_that_are_known() -> None:
    with pytest.raises(UnknownNameError) as refused:
        fabric("nylon", where="--material")
    assert all(name in refused.value.fix for name in (*CLASSES, *TABLES))
