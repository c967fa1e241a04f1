"""Sudden changes in a stream of samples."""
