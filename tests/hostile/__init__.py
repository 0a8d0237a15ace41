"""Hostile recipes, models, inputs and lakes, drawn from one seed."""

KINDS = ("recipes", "models", "inputs", "lakes")
