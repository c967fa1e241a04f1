"""Whether a default is worse than a baseline on other records of the same plant, and with what confidence."""

from collections import Counter, defaultdict
from collections.abc import Mapping

import numpy as np

from benchmarks.identification.identification_sets_data import PublicSet
from benchmarks.identification.paired_blocks import records_ratio
from estimation.arrays import Array

WORSE_RATIO = 1.02
"""Allowed ratio of a default's error to a baseline's on the test data."""

PAIRS = (("default", "first"), ("auto", "default"))
"""Pairs of models to compare: the first must not be worse than the second."""


class OtherRecords:
    """Ratios of errors over other records, collected over sets."""

    def __init__(self) -> None:
        self.ratios: dict[str, list[float]] = defaultdict(list)
        self.verdicts: dict[str, Counter[str]] = defaultdict(Counter)

    def comparison_lines(self, one: PublicSet, runs: Mapping[str, Mapping[str, Array]]) -> list[str]:
        """Return one line for each pair of models, and count its result.

        Parameters
        ----------
        one : PublicSet
            Set with other records; without them, there are no lines.
        runs : mapping
            Output of each model on each test and other record, shape (n,).
        """
        lines = list[str]()
        for name, than in PAIRS:
            if not (one.again and runs.get(name) and runs.get(than)):
                continue
            errors = [
                # a run that diverges has an infinite error
                [
                    np.nan_to_num(runs[model][key] - y, nan=np.inf, posinf=np.inf, neginf=np.inf)[one.skipped :]
                    for key, (_, y) in one.again.items()
                ]
                for model in (name, than)
            ]
            ratio, low, high = records_ratio(*errors)
            pair = f"{name} over {than}"
            self.ratios[pair].append(ratio)
            self.verdicts[pair][_verdict(ratio, low, high)] += 1
            lines.append(f"{pair} {ratio:.3f} on {len(one.again)} other records, 95 % interval {low:.2f} to {high:.2f}")
        return lines

    def summary(self) -> list[str]:
        """Return one line for each pair of models over all sets."""
        lines = list[str]()
        for pair, ratios in self.ratios.items():
            found, mean = self.verdicts[pair], float(np.exp(np.mean(np.log(ratios))))
            lines.append(
                f"{pair} on other records: {found['worse']} of {len(ratios)} surely worse by over 2 %, "
                f"{found['perhaps']} perhaps, {found['better']} surely better; "
                f"geometric mean {mean:.3f}, largest {max(ratios):.2f}"
            )
        return lines


def _verdict(ratio: float, low: float, high: float) -> str:
    """Return whether a model is worse than another by over 2 %, and whether the interval confirms it."""
    if ratio > WORSE_RATIO:
        return "worse" if low > 1.0 else "perhaps"
    return "better" if high < 1.0 else "as good"
