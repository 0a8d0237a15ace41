"""Errors of a recording, found before any model is fitted: refused or reported, never left to look
like physics.

`frames` looks at time, `shape` at the cloth's lengths, `attachment` at the pins, `surroundings` at
wind and gravity, `inertia` at what they do to the motion. Thresholds are set by what cloth does in
the reference runs (still to 8 m/s wind); each is stated where it is used.
"""
