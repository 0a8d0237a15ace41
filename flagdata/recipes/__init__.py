"""Recipes: found by name or path, parsed within limits, typed, under their former names as well;
tables of plug-ins."""
