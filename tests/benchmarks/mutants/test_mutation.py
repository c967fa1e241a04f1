"""Each planted fault changes one thing, only in formulas, and is tried on the tests of the file's folder."""

import ast
from pathlib import Path

import numpy as np
import pytest

from benchmarks.mutants.mutants import draw
from benchmarks.mutants.mutation import count_mutants, mirrored_tests, mutants_of

ROOT = Path(__file__).resolve().parents[3]


def faults(text: str) -> set[str]:
    """Return the text of the file with each of the faults."""
    return {mutant.source for mutant in mutants_of("plant/x.py", text, range(count_mutants(text)))}


@pytest.mark.parametrize(
    ("text", "wanted"),
    [
        ("y = a + b", {"y = a - b"}),
        ("y = a - b", {"y = a + b"}),
        ("y = a * b / c", {"y = a * b * c", "y = a / b / c"}),
        ("y = a ** b", {"y = a * b"}),
        ("y = -a", {"y = a"}),
        ("y = f(-a)", {"y = f(a)"}),
        ("y = 0.5", {"y = 1.0", "y = 50.0"}),
        ("y = 0", {"y = 1"}),
        ("y = a < b <= c", {"y = a >= b <= c", "y = a < b > c"}),
        ("y = a is None", {"y = a is not None"}),
        ("y = a and b", {"y = a or b"}),
        ("y = not a", {"y = a"}),
        ("y = a.reshape(-1, 3)", {"y = a.reshape(1, 3)", "y = a.reshape(-1, 6)", "y = a.reshape(-1, 300)"}),
        ("y = reshape(-1)", {"y = reshape(1)", "y = reshape(-2)", "y = reshape(-100)"}),
        ("@f\ndef g(x):\n    return x + a", {"@f\ndef g(x):\n    return x - a"}),
        ("def g(x=2):\n    return x", {"def g(x=4):\n    return x", "def g(x=200):\n    return x"}),
    ],
)
def test_each_fault_changes_one_thing(text: str, wanted: set[str]) -> None:
    assert faults(text) == wanted


@pytest.mark.parametrize(
    "text",
    [
        "y: Array[2] = x",
        "raise E(f'at most {a + 1}')",
        "s = 'a' + b",
        "s = f'{a + b}'",
        "y = x[0]",
        "y = True",
        "import a",
        '"""1 + 1"""',
    ],
)
def test_code_without_a_formula_is_not_mutated(text: str) -> None:
    assert count_mutants(text) == 0


@pytest.mark.parametrize("length", [-1, -2, -100])
def test_numpy_infers_the_remaining_length_from_any_negative_number(length: int) -> None:
    """A fault that changes only the size of this number would have no effect."""
    values = np.arange(12.0)
    np.testing.assert_array_equal(values.reshape(length, 3), values.reshape(4, 3))
    assert values[:0].reshape(3, length).shape == (3, 0)


def test_drawn_faults_change_the_code_and_leave_it_parsable() -> None:
    for mutant in draw(ROOT, ["plant/eha", "faults/diagnosis"], 30, 3):
        tree = ast.parse(mutant.source)
        assert ast.dump(tree) != ast.dump(ast.parse((ROOT / mutant.path).read_text(encoding="utf-8")))
        assert "  ->  " in mutant.change


def test_a_seed_determines_the_drawn_faults() -> None:
    once, again, other = ([m.change for m in draw(ROOT, ["plant/eha"], 20, seed)] for seed in (1, 1, 2))
    assert once == again != other


def test_a_file_is_tested_by_kept_numbers_then_its_own_tests_then_its_folder() -> None:
    assert mirrored_tests(ROOT, "plant/eha/circuit.py") == [
        "tests/plant/eha/test_numbers.py",
        "tests/plant/eha/test_circuit.py",
        "plant/eha/circuit.py",
        "tests/plant/eha",
    ]
    assert mirrored_tests(ROOT, "faults/diagnosis/calibration.py") == [
        "tests/faults/diagnosis/test_numbers.py",
        "tests/faults/diagnosis/test_numbers_steps.py",
        "tests/faults/diagnosis/test_numbers_verdict.py",
        "faults/diagnosis/calibration.py",
        "tests/faults/diagnosis",
    ]
