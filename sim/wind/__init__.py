"""Wind that drives the cloth."""
