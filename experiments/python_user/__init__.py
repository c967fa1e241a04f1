"""What a Python user holds: a log, what it says, relations between channels, equations and features of their own."""
