"""Every score of a trained model from what it said of clips it never saw, and the report of all models side by side."""
