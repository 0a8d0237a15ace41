"""The signs that divide the cells of a table, the one that is least likely to stand within a cell first."""

SIGNS = (";", "\t", "|", ",")
BLANKS = " "
"""Any run of blanks, which divides cells where no sign does."""
