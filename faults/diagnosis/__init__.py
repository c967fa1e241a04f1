"""From a log to probabilities, severities and a verdict."""
