"""How the packages are named and found: in a checkout, in an installation, and what each hands out
at its door."""
