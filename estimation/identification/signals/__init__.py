"""Samples and spectra before any fit."""
