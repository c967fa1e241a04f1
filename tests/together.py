"""Which files of tests one worker runs in one go, since they stand on what a session makes once."""

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


class WholeFiles(LoadFileScheduling):
    """Whole files to a worker, most tests first, and those that show a study together."""

    def _split_scope(self, nodeid: str) -> str:
        file = super()._split_scope(nodeid)
        return STUDIES if file in SHOW_A_STUDY else file
