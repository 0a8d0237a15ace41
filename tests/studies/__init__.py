"""Studies: what grades the product and makes what it ships. One door: `python -m tests.studies
NAME`."""
