"""A text file as lines, rows and cells, and how an unknown table in it is laid out."""
