"""What all else rests on, and nothing that knows a film: arrays, units, findings, numbers,
provenance, the terminal."""
