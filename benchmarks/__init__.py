"""Acceptance and speed measurements: `python -m benchmarks` runs all scripts, `python -m benchmarks NAME` runs one.

The scripts are in folders by subject; a name needs no folder. `benchmarks.targets` compares each figure with its
target, `benchmarks.history` stores figures, and `benchmarks.peers` has code for the other tools that ours is compared
with.
"""
