"""Run one benchmark by name, or all; `--record` before the name adds the figures to the history."""

import importlib
import sys

from benchmarks.history import record
from benchmarks.targets import kept

NAMES = (
    "filters.bulk_modulus",
    "diagnosis.classification",
    "diagnosis.foreign_logs",
    "filters.filter_speed",
    "many_logs.start_up",
    "filters.export_c",
    "filters.fmu",
    "filters.restored",
    "filters.many_filters",
    "filters.robustness",
    "filters.efficiency",
    "diagnosis.coverage",
    "filters.chamber_filter",
    "identification.identification",
    "identification.identification_tests",
    "identification.identification_sets",
    "identification.own_equations",
    "identification.bent_inputs",
    "identification.state_space",
    "identification.frequency_response",
    "plants.circuit",
    "watching.detection",
    "watching.slow_growth",
    "watching.forecast",
    "diagnosis.real_rig",
    "plants.piezo_stack",
    "plants.diaphragm_motor",
    "plants.diaphragm_faults",
    "diagnosis.diagnosis",
    "diagnosis.noisy_sensors",
    "diagnosis.random_rigs",
    "diagnosis.typed_rigs",
    "diagnosis.strange_rigs",
    "diagnosis.open_benchmark",
    "many_logs.batch_scale",
    "many_logs.archive",
    "many_logs.fleet",
    "server.server",
)
"""Every benchmark that needs only the project, in the order of `make benchmark`."""

FITS = ("diagnosis.fit_diagnosis",)
"""Those that write numbers that ship with the package."""

WITH_PEERS = ("identification.identification_peers", "watching.streaming")
"""Those that need environments of other tools, which `make peers` sets up."""

OF_TESTS = ("mutants.mutants",)
"""Those that evaluate the tests themselves, and take minutes to hours."""

OF_RUNS = ("history",)
"""Those that compare earlier runs of the others."""

ALL = {module.rpartition(".")[2]: module for module in (*NAMES, *FITS, *WITH_PEERS, *OF_TESTS, *OF_RUNS)}
"""The module of each benchmark, by its name on the command line."""


def run(name: str, arguments: list[str], *, recorded: bool) -> int:
    """Run one benchmark; return how many of its targets it missed."""
    kept.clear()
    missed = importlib.import_module(f"benchmarks.{ALL[name]}").main(arguments)
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
    for one in (module.rpartition(".")[2] for module in NAMES):
        print(f"\n== {one}")
        misses += run(one, [], recorded=recorded)
    return int(misses > 0)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
