"""A verb stated once: its options, from which the command, the Python call and their documentation
are made."""
