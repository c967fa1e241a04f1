"""A real rig's own classes: pump leakage and valve of the ZeMA test rig, judged in ten contiguous blocks of runs.

The data are sought in ``$HYDROSTATE_SHARED/data/uci_hydraulic`` (default ``../shared``).
"""

import argparse
import os
from pathlib import Path

from benchmarks.own_classes import BLOCKS, rig_verdicts
from plant.errors import HydrostateError

LEAST = 0.97


def main(arguments: list[str]) -> int:
    """Print balanced accuracy and confusion of both components; return the count of misses."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.parse_args(arguments)
    folder = Path(os.environ.get("HYDROSTATE_SHARED", "../shared")) / "data" / "uci_hydraulic"
    try:
        found = rig_verdicts(folder)
    except HydrostateError as error:
        print(f"left out: {error}")
        return 0
    misses = 0
    for name, verdicts in found.items():
        right = verdicts.balanced_accuracy >= LEAST
        misses += not right
        print(
            f"{name}: balanced accuracy {100.0 * verdicts.balanced_accuracy:.2f} % over {BLOCKS} contiguous blocks "
            f"(target {100.0 * LEAST:g} %): {'met' if right else 'MISSED'}\n{verdicts.confusion.to_string()}"
        )
    return misses
