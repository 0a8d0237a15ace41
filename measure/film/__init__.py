"""The film that is measured: which one it is, its frames made fit, its windows, and the size of its flag."""
