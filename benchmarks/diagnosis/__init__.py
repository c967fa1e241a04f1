"""Estimates and diagnoses of logs: populations, classes, severities, intervals, foreign logs, user-defined classes."""
