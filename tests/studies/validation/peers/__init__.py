"""Optimisers of a distance over [−1, 1]ᵈ that know nothing of flags, each from its own library."""
