"""Equations that a user writes, fitted to logs."""
