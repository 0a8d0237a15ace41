"""Files that are opened as text: plain and packed files, workbooks, JSON."""
