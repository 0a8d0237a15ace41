"""Vendor files to typed signals: one package or module a family of source formats; units, frame and time fixed once."""
