"""Plants for use outside Python: C99 for a controller, and what an exchange format is told of them."""
