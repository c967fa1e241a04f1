"""By how much peers are ahead of ours, how surely, and how often equally good models would be."""

from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from benchmarks.identification.paired_blocks import chance_of_lead, error_ratio
from estimation.arrays import Array

PEER_LIMITS = {
    "linear": (("default",), ("sippy", "jax-sysid"), 1.02),
    "nonlinear": (("default", "auto", "narx", "hammerstein"), ("sysidentpy", "jax-sysid-nonlinear"), 1.10),
}
"""Ours and the peers that are compared, the best of each, and the allowed ratio of errors."""


@dataclass
class _Count:
    """Tests that are compared, on which a peer is ahead by more than allowed, and surely so; and equal models would."""

    tests: int = 0
    ahead: int = 0
    surely: int = 0
    by_chance: float = 0.0


class PeerLeads:
    """Leads of peers, collected over tests."""

    def __init__(self) -> None:
        self.counts: defaultdict[str, _Count] = defaultdict(_Count)

    def lines(self, y: Array, runs: Mapping[str, Array]) -> list[str]:
        """Return a line for each peer that is ahead by more than allowed, and count the test.

        Parameters
        ----------
        y : ndarray, shape (n,)
            Output of the test.
        runs : mapping
            Output of each model, shape (n,).
        """
        left = {name: run - y for name, run in runs.items() if np.isfinite(run).all()}
        lines: list[str] = []
        for kind, (ours, peers, allowed) in PEER_LIMITS.items():
            own, peer = _best(ours, left), _best(peers, left)
            if own is None or peer is None:
                continue
            ratio, low, high = error_ratio(left[own], left[peer])
            count = self.counts[kind]
            count.tests += 1
            count.by_chance += chance_of_lead(left[own], left[peer], allowed)
            if ratio > allowed:
                count.ahead += 1
                count.surely += low > 1.0
                lines.append(f"{own} over {peer} {ratio:.2f}, 95 % interval {low:.2f} to {high:.2f}")
        return lines

    def summary(self) -> list[str]:
        """Return a line for each kind of comparison over all tests."""
        return [
            f"best {kind} peer ahead by more than {100.0 * (PEER_LIMITS[kind][2] - 1.0):.0f} %: "
            f"{one.ahead} of {one.tests} tests, {one.surely} surely; "
            f"{one.by_chance:.1f} expected if both are equally good"
            for kind, one in self.counts.items()
        ]


def _best(names: Sequence[str], left: Mapping[str, Array]) -> str | None:
    """Return the model with the smallest error; None if there is none."""
    there = [name for name in names if name in left]
    return min(there, key=lambda name: float(np.sum(left[name] ** 2)), default=None)
