"""Tests without spare processors, for a record of which test executes which line.

A thread that outlives its test would have its lines recorded for the next one. `make coverage` loads this plugin, and
leaves out the tests of the threads themselves.
"""

import pytest


def pytest_collection_finish(session: pytest.Session) -> None:  # noqa: ARG001  the hook's own name
    """Find no spare processor from here on."""
    import plant.spare_processors  # once lines are recorded

    plant.spare_processors.spare_processors = lambda: 0
