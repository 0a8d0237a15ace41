"""Effects that the library lacks: proposed from what a model leaves of recordings, tested on others, kept or not."""
