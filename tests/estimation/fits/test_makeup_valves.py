"""Make-up valves that open late, each at a pressure of its own, as those with real springs and seats do."""

import numpy as np
import pytest

from estimation.eha.explanation_notes import notes_of
from estimation.fits.flow.fit import fit_flow
from estimation.fits.hypotheses import CHECKS_CRACK
from estimation.log_checks.clean import clean_log
from estimation.notes import RigCode
from experiments.open_benchmark.logger import PLAIN_CHANNELS, Logger
from experiments.open_benchmark.machine import Machine
from experiments.open_benchmark.run import run
from plant.eha.model import EhaParameters
from plant.log.record import Record
from tests.thinned import thinned

PAPER = EhaParameters()


def logged(crack_a: float, crack_b: float) -> Record:
    """Return 2.5 s of an actuator whose make-up valves open at these pressures below the accumulator's [Pa]."""
    machine = Machine(crack_a=crack_a, crack_b=crack_b, quadratic=1.1e6, linear=0.0, coulomb=490.0)
    time = 1e-3 * np.arange(2500)
    course = np.ones((len(time), 5))
    course[:, 0] = 110.0 * np.sin(2.0 * np.pi * time) + 60.0 * np.sin(5.2 * np.pi * time)
    course[:, 3] = 0.0
    frame = Logger().log(run(machine, course), np.random.default_rng(3))
    return Record(1e-3, {name: frame[name].to_numpy() for name in PLAIN_CHANNELS})


@pytest.mark.parametrize(
    ("crack_a", "crack_b", "late"), thinned([(2.8e4, 1.2e4, "A"), (1.2e4, 2.8e4, "B")], [(1.2e4, 2.8e4, "B")])
)
def test_unequal_cracking_pressures_are_identified_and_not_mistaken_for_an_offset(
    crack_a: float, crack_b: float, late: str
) -> None:
    clean = clean_log(logged(crack_a, crack_b), PAPER)
    fit = fit_flow(clean.record, PAPER, PAPER.bulk_modulus, {}, clean.variances)
    assert fit.explanation is not None
    assert not fit.reasons
    (note,) = notes_of(fit.explanation, PAPER)
    assert note.code is RigCode.CHECKS_CRACK
    assert note.data["side"] == late
    assert note.data["later_pa"] == pytest.approx(1.6e4, abs=3e3)
    value, std = fit.parameters["bulk_modulus"]
    assert abs(value - Machine().bulk_modulus) < 3.0 * std


def test_no_cracking_pressure_is_reported_for_a_valve_that_never_opens() -> None:
    """A valve stuck shut was said to open 1e5 ± 2e8 Pa late, and the log to be healthy."""
    for value, std, told in ((2e4, 1e3, True), (1e5, 2.4e8, False), (1e5, np.inf, False)):
        assert CHECKS_CRACK.told({"crack_pressure": value}, {"crack_pressure": std}) == told


@pytest.mark.slow
def test_a_valve_that_is_stuck_shut_does_not_crack_late() -> None:
    clean = clean_log(logged(1e3, 2.7e5), PAPER)
    fit = fit_flow(clean.record, PAPER, PAPER.bulk_modulus, {}, clean.variances)
    assert fit.explanation is None or "checks_crack" not in fit.explanation.names
