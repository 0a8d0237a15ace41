"""From an experiment to the numbers of a verdict: fits beyond the linear, selection of effects, validation.

It may import `measure.nulls` and what that may import. `measure.report` writes the sentences.
"""
