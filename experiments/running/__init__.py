"""Executors and random streams of studies."""
