"""Acceptance and speed, measured: `python -m benchmarks` runs all scripts, `python -m benchmarks NAME` one.

They stand in folders by subject; a name needs no folder. `benchmarks.targets` says whether a figure is met,
`benchmarks.history` keeps figures, and `benchmarks.peers` has code in other tools beside which ours is measured.
"""
