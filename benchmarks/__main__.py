"""Run one benchmark by name, or all."""

import importlib
import sys

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

ALL = (*NAMES, *FITS, *WITH_PEERS, *OF_COMMITS, *OF_TESTS)


def main() -> int:
    """Run the named benchmark with its own arguments, or every one with its defaults."""
    if len(sys.argv) > 1:
        if sys.argv[1] not in ALL:
            print(
                f"benchmark must be one of {', '.join(ALL)}, got {sys.argv[1]!r}",
                file=sys.stderr,
            )
            return 2
        return int(importlib.import_module(f"benchmarks.{sys.argv[1]}").main(sys.argv[2:]) > 0)
    misses = 0
    for name in NAMES:
        print(f"\n== {name}")
        misses += importlib.import_module(f"benchmarks.{name}").main([])
    return int(misses > 0)


sys.exit(main())
