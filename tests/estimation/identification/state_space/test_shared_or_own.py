"""Outputs share one model or get one each, depending on held-back error and number of parameters."""

from types import SimpleNamespace
from typing import Any

import pytest

from estimation.identification.free_run.choose_linear import CLEAR_GAIN
from estimation.identification.free_run.identify import Identified
from estimation.identification.state_space import identify
from estimation.identification.state_space.identify import identify_outputs

LEFT = 0.1
"""Held-back error of the separate models, over each output's deviation [fraction]."""


def found(name: str, left: float, n_values: int, *, sound: bool = True) -> Identified:
    model: Any = SimpleNamespace(structure=name, n_values=n_values)
    quality: Any = SimpleNamespace(fit_percent=90.0)
    return Identified(model, quality, 100.0 * (1.0 - left), ({"structure": name},), (), sound)


@pytest.mark.parametrize(
    ("left", "n_values", "shared"),
    [
        (0.999 * LEFT, 19, True),  # fewer values than both separate models have together
        (1.001 * LEFT, 19, False),
        ((1.0 - 0.9 * CLEAR_GAIN) * LEFT, 20, False),  # as many values: it must be better by a hundredth
        ((1.0 - 1.1 * CLEAR_GAIN) * LEFT, 20, True),
    ],
)
def test_a_shared_model_without_fewer_parameters_must_be_better_by_one_percent(
    left: float, n_values: int, shared: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    data: Any = ["y", "z"]
    monkeypatch.setattr(identify, "identify_channels", lambda *_, **__: found("own", LEFT, 10))
    together = [found("shared", left, n_values) for _ in data]
    monkeypatch.setattr(identify, "_fitted_to_levels", lambda *_, **__: together)
    chosen = identify_outputs(data, structure="auto")
    assert [one.model.structure for one in chosen] == ["shared" if shared else "own"] * 2
    assert [[row["structure"] for row in one.candidates] for one in chosen] == [["own", "shared"]] * 2


def test_a_shared_model_with_one_unsound_output_is_rejected(monkeypatch: pytest.MonkeyPatch) -> None:
    data: Any = ["y", "z"]
    together = [found("shared", 0.5 * LEFT, 5, sound=sound) for sound in (True, False)]
    monkeypatch.setattr(identify, "identify_channels", lambda *_, **__: found("own", LEFT, 10))
    monkeypatch.setattr(identify, "_fitted_to_levels", lambda *_, **__: together)
    assert {one.model.structure for one in identify_outputs(data, structure="auto")} == {"own"}
