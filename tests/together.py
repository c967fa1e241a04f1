"""How workers share tests: whole files, in one go where they stand on the same; and each rewrites half the asserts."""

import pytest
from xdist.scheduler import LoadFileScheduling

STUDIES = "tests/experiments"

SHOW_A_STUDY = frozenset(
    f"{STUDIES}/{name}.py"
    for name in (
        "diaphragm_motor/test_figures",
        "motor_paper/test_figures",
        "nine_conditions/test_figures",
        "nine_conditions/test_filterpy_column",
        "nine_conditions/test_findings",
        "nine_conditions/test_page",
        "page/test_folder",
        "page/test_still_pages_in_browser",
        "papers/test_parts",
        "piezo_stack/test_figures",
    )
)
"""Files that ask for the studies of `tests/experiments/conftest.py`, which two workers would both make."""

MOTORS = "tests/faults/diaphragm_motor"

DIAGNOSE_A_MOTOR = frozenset(
    {
        "tests/contracts/test_actuators.py",
        "tests/experiments/batch/test_other_actuators.py",
        "tests/experiments/verbs/test_kinds_on_screen.py",
        "tests/experiments/verbs/test_motor_logs.py",
        f"{MOTORS}/test_diagnose.py",
        f"{MOTORS}/test_finding.py",
        f"{MOTORS}/test_numbers.py",
    }
)
"""Files that lay logs of a diaphragm motor beside the curves of its faults, some hundred runs of the model, which
`faults.diaphragm_motor.diagnose` keeps while the process lives."""

IN_ONE_GO = dict.fromkeys(SHOW_A_STUDY, STUDIES) | dict.fromkeys(DIAGNOSE_A_MOTOR, MOTORS)
"""What a worker takes as one, by file."""


class WholeFiles(LoadFileScheduling):
    """Whole files to a worker, most tests first, and those that stand on the same together."""

    def _split_scope(self, nodeid: str) -> str:
        file = super()._split_scope(nodeid)
        return IN_ONE_GO.get(file, file)


def backwards(folder: pytest.Collector) -> None:
    """Let a folder be collected last entry first.

    Pytest rewrites the asserts of each file once and keeps the result. In a fresh clone that is more than half of
    collecting. Workers that go through the files in one order rewrite most of them twice; one that begins at the other
    end meets its neighbour halfway, and each reads what the other has kept.
    """
    collect = folder.collect
    folder.collect = lambda: reversed(list(collect()))


def from_its_end(worker: str) -> bool:
    """Return whether a worker collects folders from their ends: every second one, by the number in its name."""
    return worker.startswith("gw") and int(worker.removeprefix("gw")) % 2 == 1


def in_one_order(items: list[pytest.Item]) -> None:
    """Sort tests by file, since workers must have collected the same in the same order."""
    items.sort(key=lambda item: item.nodeid.partition("::")[0])
