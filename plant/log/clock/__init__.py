"""Converts the time stamps of a log to one uniform clock."""
