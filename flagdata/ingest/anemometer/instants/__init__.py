"""Stamps of a log, made instants in UTC: formats, dates, zones, clocks that were set anew."""
