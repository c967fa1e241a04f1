"""Acceptance and speed, measured: `python -m benchmarks` lists the scripts, `python -m benchmarks NAME` runs one."""
