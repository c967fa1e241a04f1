"""Criterion, first guesses and descent."""
