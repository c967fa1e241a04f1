"""The parts of the nine-condition study, one question a file; each returns plain tables."""
