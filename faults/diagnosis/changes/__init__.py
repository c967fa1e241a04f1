"""What changed within a log, and when."""
