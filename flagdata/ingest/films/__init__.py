"""Films by what names them, opened, and as arrays."""
