"""A function is pasted into a kernel as written, without the parts that a kernel does not need."""

import math
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from plant.compiled.native.load import load_native
from plant.compiled.native.signature import signature
from plant.compiled.paste import bare_text, functions_text, kernel_text

LIMIT = 3.0


def clipped(value: float, least: float = 0.0) -> float:
    """Return a value within its limits."""
    return max(least, min(value, LIMIT))  # the pasted text has neither comment nor docstring


def total(values: NDArray[np.float64]) -> float:
    result: float = 0.0
    for value in values:
        result += clipped(math.sqrt(value))
    return result


def test_pasted_text_has_no_annotations_docstrings_or_comments() -> None:
    assert bare_text(clipped) == "def clipped(value, least=0.0):\n    return max(least, min(value, LIMIT))"


def test_a_pasted_function_computes_what_the_function_does() -> None:
    text = kernel_text(
        "a sum", functions_text(clipped, inlined=True, constants={"LIMIT": LIMIT}), functions_text(total)
    )
    values = np.array([0.5, 4.0, 16.0])
    kernel = load_native("pasted_sum", text, {"total": signature("values : ndarray, shape (n,)")})
    assert kernel.total(values) == total(values)


def test_only_functions_written_with_def_can_be_pasted() -> None:
    with pytest.raises(TypeError, match="written with def"):
        functions_text(Path)
