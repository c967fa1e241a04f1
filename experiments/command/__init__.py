"""The verbs of the command `hydrostate`, one a file, and what they share."""
