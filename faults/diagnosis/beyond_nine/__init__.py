"""Causes beyond the nine conditions: a load, an oil, a worn pump, a valve."""
