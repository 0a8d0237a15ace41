"""Wind and cloth of one recording, with intervals, or the reason why not: what `flagdata measure` does."""
