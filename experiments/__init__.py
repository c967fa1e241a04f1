"""Studies, published numbers, figures, reports, and the command `hydrostate`."""
