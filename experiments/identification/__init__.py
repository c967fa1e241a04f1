"""The verb `hydrostate identify`: models between channels of a bench, or between any columns."""
