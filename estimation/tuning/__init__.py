"""Noise levels by likelihood."""
