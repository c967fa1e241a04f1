"""Executors and random streams for studies."""
