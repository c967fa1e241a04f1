"""Forks run only the chosen tests, in order and on the current files, and end after a limited time."""

import json
import os
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[3]

TESTS = """
from thing import VALUE

def test_value():
    assert VALUE == 1

def test_other():
    assert VALUE < 3
"""


def test_each_fork_runs_the_chosen_tests_on_the_current_files(tmp_path: Path) -> None:
    thing = tmp_path / "thing.py"
    (tmp_path / "test_thing.py").write_text(TESTS)
    (tmp_path / "pytest.ini").write_text("[pytest]\nmarkers = slow: none\n")
    names = ["test_thing.py::test_other", "test_thing.py::test_value"]
    task = json.dumps({"tests": names, "files": ["test_thing.py"], "seconds": 60.0}) + "\n"
    with subprocess.Popen(  # noqa: S603  our own
        [
            sys.executable,
            "-c",
            f"import sys; sys.path[:0] = [{str(ROOT)!r}, '.']; import benchmarks.mutants.forked as f; f.main()",
        ],
        cwd=tmp_path,
        env={**os.environ, "PYTEST_DISABLE_PLUGIN_AUTOLOAD": "1"},  # plugins take seconds to import
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
    ) as runner:
        assert runner.stdin is not None
        assert runner.stdout is not None
        answers = []
        for value in (1, 2, 3):
            thing.write_text(f"VALUE = {value}")
            runner.stdin.write(task)
            runner.stdin.flush()
            answers.append(json.loads(runner.stdout.readline()))
        runner.stdin.close()
    assert [(one["code"], one["failed"], one["tried"]) for one in answers] == [
        (0, [], 2),
        (1, names[1:], 2),
        (1, names[:1], 1),
    ]
