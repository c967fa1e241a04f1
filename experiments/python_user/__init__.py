"""Objects of the Python interface: log, answers, relations between channels, own equations and features."""
