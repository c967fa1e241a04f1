"""The pairs of disturbances that a bench is likely to have."""

from benchmarks.diagnosis.open_benchmark import USUAL_PAIRS
from experiments.open_benchmark.kinds import kind_of


def test_each_usual_pair_can_be_drawn() -> None:
    kinds = [kind_of(name) for name in USUAL_PAIRS]
    assert len({kind.name for kind in kinds}) == len(USUAL_PAIRS)
    assert all(kind.conditions and kind.drives for kind in kinds)
