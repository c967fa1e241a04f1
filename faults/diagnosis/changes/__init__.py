"""Changes within a log and their times."""
