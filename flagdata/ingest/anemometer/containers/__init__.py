"""Files that hold a table and are no plain text of it."""
