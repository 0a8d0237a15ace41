"""The networks and their heads, what they estimate, and each by its name."""
