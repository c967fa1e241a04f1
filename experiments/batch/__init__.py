"""Batch studies: thousands of cases from one study file, in a store that survives any interruption."""
