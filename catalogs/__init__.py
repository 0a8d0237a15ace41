"""Recipes and data tables: TOML and CSV only, read through importlib.resources."""
