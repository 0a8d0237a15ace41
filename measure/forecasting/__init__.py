"""The problem: an experiment made ready, the model of its cloth, the regressors it may differ along, its forecasts.

It may import `measure.observe` and the simulator, and no other stage of a verdict.
"""
