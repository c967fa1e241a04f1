"""Measurement of a run by a bench: noise, quantisation, rate, and sensors that fail."""
