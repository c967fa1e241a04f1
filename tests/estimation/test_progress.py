"""What a search reports about the models that it tries."""

import numpy as np

from estimation.identification.free_run.data import channels_from
from estimation.identification.free_run.identify import identify_channels
from estimation.progress import report_progress, reporting_to


def test_progress_reaches_only_the_innermost_listener_and_only_inside_its_block() -> None:
    outer, inner = list[str](), list[str]()
    with reporting_to(outer.append):
        report_progress("first")
        with reporting_to(inner.append):
            report_progress("second")
        report_progress("third")
    report_progress("nobody")
    assert (outer, inner) == (["first", "third"], ["second"])


def test_an_identification_reports_progress_of_each_kind_of_model() -> None:
    rng = np.random.default_rng(3)
    u, y = rng.uniform(-1.0, 1.0, 300), np.zeros(300)
    for t in range(1, 300):
        y[t] = 0.7 * y[t - 1] + 0.3 * u[t - 1] + 0.2 * u[t - 1] ** 2
    data = channels_from([u[:, None]], [y + 0.01 * rng.normal(size=300)], 0.01, ["u"], "y")
    heard = list[str]()
    with reporting_to(heard.append):
        identify_channels(data, structure="auto", order=1, delay=1)
    kinds = list(dict.fromkeys(heard))
    grown = ["products that grow", "polynomial models", "error models"]
    assert kinds == ["linear models", "outputs with limits", "nonlinear inputs", *grown]
    assert all(heard.count(one) > 1 for one in kinds if one != "linear models")
