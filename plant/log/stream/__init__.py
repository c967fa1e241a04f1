"""Rows of a log that is still being written."""
