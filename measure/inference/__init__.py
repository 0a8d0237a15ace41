"""The linear model of a segment's statistics: the random effect of a kind of numerics, least squares beside it, scores.

It may import `measure.probes` and what that may import. It simulates nothing.
"""
