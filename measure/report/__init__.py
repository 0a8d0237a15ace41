"""Reports of closing the loop: a page that holds everything in itself, words for the terminal, and JSON."""
