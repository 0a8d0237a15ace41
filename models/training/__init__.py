"""Training from catalogs: recipes, inputs that were prepared once, steps that can be taken up again, checkpoints."""
