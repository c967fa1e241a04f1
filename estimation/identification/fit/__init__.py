"""One structure a file; order, validation and intervals."""
