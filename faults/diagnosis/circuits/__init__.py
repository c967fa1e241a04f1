"""Circuits fitted to a log, and what they say of the nine conditions."""
