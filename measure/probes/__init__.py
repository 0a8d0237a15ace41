"""What is looked at in the errors of forecasts: sums along the regressors, spectral lines, moments, the wind's course.

It may import `measure.forecasting`, and the criteria from `measure.verdict`.
"""
