"""Mutated files read as by every verb: a record, or an error in one sentence; no internal error, hang or crash.

Run it as ``python -m tests.fuzz.files 5000``; a failure is reported with its kind and seed.
"""

import json
import resource
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

from experiments.command.json_output import plain
from experiments.command.logs import read_log
from experiments.log_pages.inspected import inspect_log
from tests.fuzz.guard import limited
from tests.fuzz.mutations import CELLS, mutated
from tests.fuzz.seeds import seeds


def read(path: Path) -> None:
    """Read a file as the verbs do."""
    record = read_log(path, {}, {})
    if not all(np.isfinite(record.time)):
        raise AssertionError("a record without a clock")


def inspect(path: Path) -> None:
    """Inspect a file as the command does."""
    found, _ = inspect_log(path, None)
    json.dumps(plain(found), allow_nan=False)


def run(count: int, first: int = 0) -> list[str]:
    """Mutate a number of files, and return the failures with kind and seed."""
    wrong: list[str] = []
    with tempfile.TemporaryDirectory() as folder:
        made = seeds(Path(folder))
        kinds = list(made)
        for seed in range(first, first + count):
            kind = kinds[seed % len(kinds)]
            name, content = made[kind]
            path = Path(folder) / f"mutated-{name}"
            path.write_bytes(mutated(content, np.random.default_rng(seed), CELLS))
            said = [limited(lambda path=path, use=use: use(path)) for use in (read, inspect)]
            wrong += [f"{kind}, seed {seed}: {one}" for one in said if one]
    return wrong


if __name__ == "__main__":
    begun, total = time.monotonic(), int(sys.argv[1])
    resource.setrlimit(resource.RLIMIT_AS, (8 << 30, 8 << 30))
    found = run(total, int(sys.argv[2]) if len(sys.argv) > 2 else 0)
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    sys.stdout.write(
        "\n".join([*found, f"{total} files, {len(found)} wrong, {time.monotonic() - begun:.0f} s, {peak:.0f} MB\n"])
    )
    sys.exit(bool(found))
