"""`flagdata calibrate`: the cloth of a filmed flag weighed with the log of the wind beside it."""
