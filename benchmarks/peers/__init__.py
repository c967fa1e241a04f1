"""Reference implementations of the filters: the same filter as an expert or a user of another tool would write it."""
