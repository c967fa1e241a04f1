"""The criterion, starts and descent of a fit."""
