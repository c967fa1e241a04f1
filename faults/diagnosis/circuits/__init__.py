"""Circuits fitted to a log, and their evidence on the nine conditions."""
