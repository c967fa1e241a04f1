"""Whether two commits give the same numbers."""
