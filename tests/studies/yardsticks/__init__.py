"""Yardsticks of a paper's table, beside networks that were judged: what needs no network, and what
embeddings are worth."""
