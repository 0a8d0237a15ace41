"""Which columns of an unknown table are its time."""
