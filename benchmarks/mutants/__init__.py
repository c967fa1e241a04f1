"""Whether the tests notice planted faults."""
