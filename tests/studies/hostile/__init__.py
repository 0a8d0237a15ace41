"""Hostile recipes, models, inputs, files and lakes, drawn from one seed; and bombs made by hand."""

KINDS = ("recipes", "models", "inputs", "files", "lakes", "bombs")
