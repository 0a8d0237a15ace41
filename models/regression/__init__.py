"""Estimates without a network: hand-made features, ridge regression, boosting."""
