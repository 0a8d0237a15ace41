"""From a recipe to mesh sequences in a lake: members are drawn, run in batches, diagnosed and
published.

A recipe is a TOML file (see `sim.run.simulation_toml`), one of `catalogs/scenes` by name, or an
ArcSim scene file.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from flagdata.packages.lazy import lazy_exports
from sim.run.publish import Progress, RunReport, simulate
from sim.run.simulation_recipe import Recipe
from sim.run.simulation_toml import load

if TYPE_CHECKING:
    from sim.run.member_batch import CRUMPLED, BatchOutcome, Stepper, principal_strains, run
    from sim.run.members import Crew
    from sim.run.publish import member_artifact, simulate
    from sim.run.simulate_call import recipe_of
    from sim.run.simulation_recipe import IntegratorSpec, MaterialSpec, Recipe, Shape
    from sim.run.simulation_toml import of_content, parse


__all__ = ["Progress", "Recipe", "RunReport", "load", "simulate"]

__getattr__ = lazy_exports(__name__, __file__)
