"""Refinement by simulation: what cloth and wind, simulated and filmed as the target was, look like it.

Runia et al. 2020, sections 3.2 and 6: simulate, render with fixed ζ, embed, compare, choose the next θ. `refine` is
this project's own procedure (`measure.refine.procedure`) over the paper's 17 parameters (`measure.refine.space`). The
paper's own optimiser and others belong to the validation, which runs them on the same evaluator
(`measure.refine.evaluator`).
"""
