"""Run one benchmark by name, or all; `--record` before the name adds the figures to the history."""

import importlib
import sys

from benchmarks.history import record
from benchmarks.targets import kept

NAMES = (
    "bulk_modulus",
    "classification",
    "foreign_logs",
    "filter_speed",
    "start_up",
    "export_c",
    "fmu",
    "restored",
    "many_filters",
    "robustness",
    "efficiency",
    "coverage",
    "convergence",
    "chamber_filter",
    "identification",
    "identification_tests",
    "identification_sets",
    "own_equations",
    "bent_inputs",
    "state_space",
    "frequency_response",
    "circuit",
    "detection",
    "slow_growth",
    "forecast",
    "real_rig",
    "piezo_stack",
    "diaphragm_motor",
    "diaphragm_faults",
    "diagnosis",
    "noisy_sensors",
    "open_benchmark",
    "batch_scale",
    "archive",
    "fleet",
    "server",
)
"""Every benchmark that needs nothing but the project, in the order of `make benchmark`."""

FITS = ("fit_diagnosis",)
"""Those that write numbers which ship with the package."""

WITH_PEERS = ("identification_peers", "streaming")
"""Those that need environments of other tools, which `make peers` sets up."""

OF_COMMITS = ("same_numbers",)
"""Those that compare commits, named behind the script's name."""

OF_TESTS = ("mutants",)
"""Those that ask the tests themselves, and take minutes to hours."""

OF_RUNS = ("history",)
"""Those that compare earlier runs of the others."""

ALL = (*NAMES, *FITS, *WITH_PEERS, *OF_COMMITS, *OF_TESTS, *OF_RUNS)


def run(name: str, arguments: list[str], *, recorded: bool) -> int:
    """Run one benchmark; return how many of its targets it missed."""
    kept.clear()
    missed = importlib.import_module(f"benchmarks.{name}").main(arguments)
    if recorded and kept:
        print(f"{record(' '.join([name, *arguments]), kept)} figures added to the history")
    return missed


def main(words: list[str]) -> int:
    """Run the named benchmark with its own arguments, or every one with its defaults."""
    recorded = words[:1] == ["--record"]
    name, *arguments = words[recorded:] or [""]
    if name and name not in ALL:
        print(f"benchmark must be one of {', '.join(ALL)}, got {name!r}", file=sys.stderr)
        return 2
    if name:
        return int(run(name, arguments, recorded=recorded) > 0)
    misses = 0
    for one in NAMES:
        print(f"\n== {one}")
        misses += run(one, [], recorded=recorded)
    return int(misses > 0)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
