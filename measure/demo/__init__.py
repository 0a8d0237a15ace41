"""The demonstration: a field recording made here, taken through the whole tool to a page one can open."""
