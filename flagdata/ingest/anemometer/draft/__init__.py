"""What a table that no recipe describes may be: facts with their evidence, and questions; no rows
come of it."""
