"""A user's own equations, fitted to logs."""
