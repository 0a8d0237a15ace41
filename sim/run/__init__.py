"""From a recipe to mesh sequences in a lake: members are drawn, run in batches, diagnosed and published.

A recipe is a TOML file (see `sim.run.reading`), one of `catalogs/scenes` by name, or an ArcSim scene file.
"""

from sim.run.publish import Progress, RunReport, simulate
from sim.run.reading import load
from sim.run.recipe import Recipe

__all__ = ["Progress", "Recipe", "RunReport", "load", "simulate"]
