"""Text that is no table, stated again as one that every format reads; one kind a file."""
