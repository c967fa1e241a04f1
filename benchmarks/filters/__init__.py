"""Filters: bulk modulus from many first guesses, bounds, speed, C and FMUs, and restarted filters."""
