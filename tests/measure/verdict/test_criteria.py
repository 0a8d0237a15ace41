"""Thresholds live in one frozen object, which verdicts record; nowhere else in the stages of a
verdict is one."""

from __future__ import annotations

import ast
from dataclasses import FrozenInstanceError, replace
from pathlib import Path

import pytest

from flagdata.core.json_values import json_values
from flagdata.errors import UsageError
from measure.verdict import CRITERIA
from measure.verdict.criteria import Criteria

MEASURE = Path(__file__).resolve().parents[3] / "measure"
STAGES = ("verdict", "forecasting", "probes", "inference", "nulls", "loop", "closing")

METHOD = {
    "closing/joint_verdict": {"_CERTAIN"},
    "forecasting/alignment": {"_CALM"},
    "forecasting/calibrated_parameters": {
        "_AREA_WEIGHT",
        "_BENDING",
        "_DAMPING",
        "PRIOR",
        "PRIOR_WITHOUT_MASS",
    },
    "forecasting/model": {"_SHARE"},
    "forecasting/observer": {"WIDEST", "_JOINT"},
    "forecasting/regressors": {"_MODES", "_MOTIONS"},
    "forecasting/recorded": {"STATED_WEIGHT", "_DIRECTION"},
    "forecasting/segments": {"HORIZON", "_SEGMENT", "_SHORTEST", "_WARM_UP"},
    "probes/wind_course": {"ALONG", "LEFT", "_WINDOW"},
    "probes/lines": {"REDUCED", "STROUHAL", "_POINTS", "_NEAR", "_EDGE"},
    "probes/settled": {"_EDGE", "_LEAST"},
    "probes/statistics": {"_CHUNK", "_CLIP", "_NEVER", "_NOISE"},
    "probes/wind_log": {"NUISANCES", "DIRECTION", "_STEPS", "_REACH", "_LAGS", "_CALM"},
    "inference/segment_evidence": {"_HERE"},
    "inference/random_effect": {"_SHIFTS", "_POWERS", "_UNSEEN"},
    "nulls/bank": {"WINDS", "_VERSION", "_AREA_WEIGHT", "_BENDING", "_DAMPING"},
    "nulls/conformal": {"MOST_KINDS"},
    "nulls/free_run": {"_COPIES"},
    "nulls/stiffness": {"_STRETCHING", "_APART"},
    "nulls/directed_test": {"SHOWN", "_OWN_VARIANCE", "_SLOPES", "_SIZES", "_DAMPINGS", "_TINY"},
    "nulls/marker_summary": {"APPEARS", "_STILL"},
    "nulls/null_groups": {"_LEAST_LEFT"},
    "nulls/reference": {"_GROUPS", "_UNOBSERVABLE", "_NARROWEST"},
    "nulls/null_meshes": {"_UNEVEN"},
    "nulls/null_plan": {"_FIRST_LOOK"},
    "nulls/null_simulation": {
        "SETTLE",
        "_FINER",
        "_STEPS",
        "_SAMPLED",
        "CARRIED",
        "_LEVEL",
        "_HALVINGS",
        "_GENTLE",
    },
    "nulls/tracks": {"_TURN", "_WEIGHTS", "_HALVINGS"},
    "nulls/winds": {"_STEADY", "_STILL", "_EVERY"},
    "loop/gauss_newton": {"ROUNDS", "_FEW", "_HALVINGS", "STAYS", "_LONGEST", "_TRIED"},
    "loop/refit": {"COUNT", "BEYOND", "_WITHIN_THE_END", "_AT_THE_END"},
    "loop/residuals": {"_SHOWN"},
    "loop/run": {"_FLOOR_COPIES", "_LOOKS"},
    "loop/effect_selection": {"GUST_COLUMN"},
    "loop/validation": {"_DURATION", "_ENOUGH"},
    "verdict/quantity": {"_DIGITS", "_MOST_DIGITS", "_WIDEST", "_NARROWEST"},
    "nulls/null_workload": {"_PACE", "_JUDGED"},
    "closing/verdict_artifacts": {"_FORMAT"},
    "closing/model_recipes": {"_SETTLE", "_FRAMES", "_ROUGH"},
}
"""Numbers that say what is simulated, how errors are brought down and how it is shown; no verdict
is decided by one."""
PLAIN = {0, 1, 2, 3, -1}
"""Counts and places, not thresholds."""


def numbers(node: ast.AST) -> list[float]:
    return [
        found.value
        for found in ast.walk(node)
        if isinstance(found, ast.Constant) and type(found.value) in (int, float)
    ]


def constants(path: Path) -> set[str]:
    """Names of upper case that a module binds to something with a number in it."""
    names: set[str] = set()
    for node in ast.parse(path.read_text(encoding="utf-8")).body:
        targets = (
            node.targets
            if isinstance(node, ast.Assign)
            else [node.target]
            if isinstance(node, ast.AnnAssign)
            else []
        )
        if (
            isinstance(node, ast.Assign | ast.AnnAssign)
            and node.value is not None
            and numbers(node.value)
        ):
            for target in targets:
                names |= {
                    n.id
                    for n in ast.walk(target)
                    if isinstance(n, ast.Name) and n.id.upper() == n.id
                }
    return names


def test_no_threshold_lives_outside_the_criteria() -> None:
    tables = {
        "THETA",
        "_FIRST",
        "_AXES",
        "SHAPES",
    }  # of parameters, places and names, in which numbers are no limits
    modules = {
        f"{stage}/{path.stem}": path for stage in STAGES for path in (MEASURE / stage).glob("*.py")
    }
    assert modules.pop("verdict/criteria")
    assert len(modules) > 40
    found = {
        (name, constant)
        for name, path in modules.items()
        for constant in constants(path) - METHOD.get(name, set())
        if constant not in tables and not constant.startswith("_STEPS")
    }
    assert found == set()


@pytest.mark.parametrize(
    "name",
    [
        "loop/effect_selection",
        "loop/run",
        "loop/refit",
        "nulls/conformal",
        "nulls/clustered",
        "verdict/decided",
    ],
)
def test_what_decides_compares_with_no_number_of_its_own(name: str) -> None:
    tree = ast.parse((MEASURE / f"{name}.py").read_text(encoding="utf-8"))
    compared = {
        value for node in ast.walk(tree) if isinstance(node, ast.Compare) for value in numbers(node)
    }
    assert compared <= PLAIN


def test_the_hash_is_that_of_the_values() -> None:
    assert Criteria().hash == CRITERIA.hash == json_values(CRITERIA)["hash"]
    assert replace(CRITERIA, lead=2.5).hash != CRITERIA.hash


def test_criteria_cannot_be_changed() -> None:
    with pytest.raises(FrozenInstanceError):
        CRITERIA.level = 0.5  # pyright: ignore[reportAttributeAccessIssue]


@pytest.mark.parametrize("name", ["level", "interval", "room"])
def test_a_share_is_between_nothing_and_all(name: str) -> None:
    with pytest.raises(UsageError, match="between 0 and 1"):
        replace(CRITERIA, **{name: 1.0})
