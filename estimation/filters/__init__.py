"""Filters and smoothers, one in each file, with their loops in files beside them."""
