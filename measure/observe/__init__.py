"""Observed trajectories: what was seen of a cloth, on which specimen, in which wind; read and checked before anything
is concluded from them."""
