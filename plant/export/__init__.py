"""Plants for use outside Python: C99 for a controller, and the description for an exchange format."""
