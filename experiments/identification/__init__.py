"""What `hydrostate identify` makes of logs: models between channels of a bench, or between any columns."""
