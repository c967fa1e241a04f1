"""Distributes tests to workers: whole files, grouped by costly fixtures; each worker rewrites half the asserts."""

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
"""Files that use the studies of `tests/experiments/conftest.py`; on two workers, both would compute them."""

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
"""Files that compare logs of a diaphragm motor with the curves of its faults, some hundred runs of the model;
`faults.diaphragm_motor.diagnose` keeps these curves while the process lives."""

IN_ONE_GO = dict.fromkeys(SHOW_A_STUDY, STUDIES) | dict.fromkeys(DIAGNOSE_A_MOTOR, MOTORS)
"""The group of files that one worker takes together, by file."""


class WholeFiles(LoadFileScheduling):
    """Scheduler that gives workers whole files, those with most tests first; files that share fixtures go together."""

    def _split_scope(self, nodeid: str) -> str:
        file = super()._split_scope(nodeid)
        return IN_ONE_GO.get(file, file)


def backwards(folder: pytest.Collector) -> None:
    """Let a folder be collected in reverse order.

    Pytest rewrites the asserts of each file once and caches the result. In a fresh clone, this is more than half of the
    time for collecting. If all workers go through the files in the same order, they rewrite most of them twice. If one
    begins at the other end, the two meet halfway, and each reads the other's cached results.
    """
    collect = folder.collect
    folder.collect = lambda: reversed(list(collect()))


def from_its_end(worker: str) -> bool:
    """Return whether a worker collects folders in reverse: every second one, by the number in its name."""
    return worker.startswith("gw") and int(worker.removeprefix("gw")) % 2 == 1


def in_one_order(items: list[pytest.Item]) -> None:
    """Sort tests by file, because all workers must collect the same tests in the same order."""
    items.sort(key=lambda item: item.nodeid.partition("::")[0])
