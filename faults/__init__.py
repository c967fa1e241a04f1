"""The nine conditions, fault injection and severity, and the classification of a log into a condition."""
