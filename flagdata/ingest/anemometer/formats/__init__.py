"""Formats of loggers, instruments and services, one a file."""
