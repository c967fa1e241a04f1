"""`Record`, and everything that reads or writes a log."""
