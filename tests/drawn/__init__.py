"""A flag drawn by formulas, for tests in which only when something moves matters."""
