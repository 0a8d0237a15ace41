"""Self-contained HTML pages: one frame and one style for the demonstration and the reports."""
