"""The calls of `flagdata`, each a door to what the command of its name does; `flagdata` exports
them lazily."""
