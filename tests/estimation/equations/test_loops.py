"""The loop over a user's equations, run as plain Python, gives the same result as its kernel."""

from typing import Any

import numpy as np
import pytest

from estimation.equations import kernel, loops
from estimation.equations.definition import Equations, Parameter
from estimation.equations.kernel import compile_equations
from tests.kernels import functions_of, text_of


def falling(state: Any, inputs: Any, p: Any) -> Any:
    return state.speed, inputs.push - p.damping * state.speed - p.stiffness * np.sin(state.place)


EQUATIONS = Equations(
    falling,
    states={"place": "m", "speed": "m/s"},
    inputs={"push": "N/kg"},
    outputs={"place": "m", "speed": "m/s"},
    parameters={"damping": Parameter(0.5), "stiffness": Parameter(9.0)},
    initial={"speed": 0.25},
)


@pytest.mark.parametrize("scheme", ["rk4", "ros2"])
@pytest.mark.parametrize("sloped", [True, False])
def test_a_compiled_simulation_gives_the_same_numbers_as_python(
    scheme: str, sloped: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    make = getattr(compile_equations, "__wrapped__", compile_equations)
    text = text_of(monkeypatch, kernel, lambda: make(EQUATIONS, scheme))
    values, known = np.array([0.4, 8.0, 0.1]), np.array([0.25])
    push = np.cos(0.3 * np.arange(12.0))[:, None]
    found, wanted = ((np.full((2, 12), np.nan), np.zeros((2, 12, 3) if sloped else (0, 0, 3))) for _ in range(2))
    compile_equations(EQUATIONS, scheme)(values, known, push, 0.05, 3, *found)
    loops.run(functions_of(text), values, known, push, 0.05, 3, *wanted)
    for one, other in zip(found, wanted, strict=True):
        np.testing.assert_allclose(one, other, rtol=1e-13, atol=1e-15)
    assert found[0][:, 0].tolist() == [0.1, 0.25]
