"""One filter or smoother a file, its loop beside it."""
