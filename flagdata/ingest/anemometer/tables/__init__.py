"""Tables: read by a recipe, by their headings, or by a draft that says what is missing."""
