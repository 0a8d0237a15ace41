"""Tables read by a recipe: cells, clock, units and codes."""
