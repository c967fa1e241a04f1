"""Filters and models for use outside Python: C99, exchange formats of other tools."""
