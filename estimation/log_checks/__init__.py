"""Checks of a log's sensors: noise, outliers, gaps, frozen or clipped channels."""
