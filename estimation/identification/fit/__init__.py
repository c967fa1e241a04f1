"""Fits: one structure in each file; order, validation and intervals."""
