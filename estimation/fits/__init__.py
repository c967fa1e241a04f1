"""Least squares on a whole log."""
