"""Estimates and diagnoses of logs: populations, classes, severities, intervals, logs of others, own classes."""
