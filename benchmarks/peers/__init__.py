"""What the filters are measured against: the same filter as an expert, or a user, of another tool would write it."""
