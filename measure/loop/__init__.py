"""From an experiment to the numbers of a verdict: fits beyond the linear, selection of effects, validation.

It may import `measure.nulls` and what that may import. What is said of the numbers is in `measure.report`.
"""
