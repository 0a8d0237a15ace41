"""The kit of all reports: one frame and style, escaped text, tables, figures and pictures inside a single HTML file."""
