"""Inputs to identify with, dead time, and sticking."""
