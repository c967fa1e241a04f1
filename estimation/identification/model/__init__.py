"""Identified models and their properties."""
