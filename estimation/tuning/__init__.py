"""Tuning of noise levels by likelihood."""
