"""The server under hostile clients, killed during its work, and with a stream of 10 kHz.

`python -m benchmarks server --requests 10000 --clients 200 --seconds 600` is the full test; the defaults are shorter.
"""

import argparse
import tempfile
from collections.abc import Sequence
from pathlib import Path

from benchmarks.server.hostile_client import server_errors
from benchmarks.server.server_trials import attack, kill, stream
from benchmarks.targets import check_target, misses

MB = 1 << 20


def main(arguments: Sequence[str]) -> int:
    """Print the measurements with their targets; return how many fell short."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks server")
    parser.add_argument("--requests", type=int, default=2000)
    parser.add_argument("--clients", type=int, default=200)
    parser.add_argument("--seconds", type=float, default=60.0)
    parser.add_argument("--rate", type=float, default=10_000.0)
    parser.add_argument("--uploads", type=int, default=20)
    asked = parser.parse_args(arguments)
    misses.clear()
    with tempfile.TemporaryDirectory() as place:
        if asked.requests:
            found = attack(folder(place, "attacked"), asked.requests, asked.clients)
            print(f"{asked.requests} requests of {asked.clients} clients in {found.seconds:.0f} s:")
            for kind, count in sorted(found.answers.items()):
                print(f"  {kind}: {count}")
            honest = {status: found.polite.count(status) for status in set(found.polite)}
            told = ", ".join(f"{one / MB:.0f}" for one in found.memory)
            print(f"an honest client meanwhile: {honest}; memory before and after each quarter: {told} MB")
            check_target("answers with a status of 500 or more", sum(server_errors(found.answers).values()), 0.0)
            check_target("files outside the folder", len(found.strange), 0.0)
            check_target("growth of memory in the last half [MB]", (found.memory[-1] - found.memory[2]) / MB, 10.0)
            check_target("growth of memory at its height [MB]", (found.most - found.memory[0]) / MB, 60.0)
            check_target("an honest client's longest wait [s]", found.slowest, 10.0)
        if asked.uploads:
            killed = kill(folder(place, "killed"), asked.uploads, asked.uploads // 4)
            print(f"killed with {killed.accepted} logs taken and {killed.finished} finished")
            check_target("finished results lost", len(killed.lost), 0.0)
            check_target("taken logs neither finished nor said to be interrupted", len(killed.unfinished), 0.0)
        if asked.seconds:
            streamed = stream(folder(place, "streamed"), asked.seconds, asked.rate)
            print(f"{streamed.sent} rows in {asked.seconds:g} s, all taken {streamed.behind:.1f} s after the last")
            check_target("rows lost", streamed.sent - streamed.taken, 0.0)
            check_target("gaps", streamed.gaps, 0.0)
            check_target("processor time [% of a core]", 100.0 * streamed.share, 30.0)
    return len(misses)


def folder(place: str, name: str) -> Path:
    """Return a new folder."""
    made = Path(place) / name
    made.mkdir()
    return made
