"""Runs tests without spare processors, to record which test executes which line.

If a thread outlives its test, its lines are recorded for the next test. `make coverage` loads this plugin, and leaves
out the tests of the threads themselves.
"""

import pytest


def pytest_collection_finish(session: pytest.Session) -> None:  # noqa: ARG001  the hook's own name
    """Report that there are no spare processors, from here on."""
    import plant.spare_processors  # imported only after recording has started

    plant.spare_processors.spare_processors = lambda: 0
