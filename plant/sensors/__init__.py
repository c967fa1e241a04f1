"""Measurement of a run on a bench: noise, quantisation, rate, and sensor faults."""
