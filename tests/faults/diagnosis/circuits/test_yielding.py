"""A piston that hardly moves yields on its seals, and a circuit need not follow it exactly."""

from dataclasses import replace

import numpy as np
import pytest

from faults.diagnosis.circuits.class_fit import scales_of
from faults.diagnosis.circuits.out_of_model import reasons_against
from faults.diagnosis.circuits.yielding import YIELDING_SHARE
from faults.notes import AgainstCode
from tests.faults.diagnosis.circuits.test_out_of_model import ACTUATOR, NOISE, fitted, healthy


def creeping_is_unexplained(share: float, followed: float, *, pressure: bool) -> bool:
    """Return whether a circuit is rejected that leaves ``share`` of the pump's flow in the motion of a creeping piston.

    The motion that it follows is ``followed`` times what it leaves.
    """
    place = ACTUATOR.conditions[0]
    log, pump = healthy(), ACTUATOR.circuit.pump_displacement / ACTUATOR.circuit.piston_area
    whole = pump * float(np.sqrt(np.mean(log.speed**2)))
    there = np.arange(len(log.velocity))
    left, motion = (np.where(there % period < period // 2, 1.0, -1.0) for period in (100, 400))
    run = np.column_stack([followed * share * whole * motion, log.outputs[:, 1]])[:, : 1 + pressure]
    creeping = replace(log, velocity=run[:, 0] + share * whole * left, noise=NOISE[: 1 + pressure])
    creeping = creeping if pressure else replace(creeping, pressure=None)
    near = fitted(log, place)
    slopes = near.best.slopes[..., : 1 + pressure]
    fits = replace(near.best, fitted=run, slopes=slopes, scales=scales_of(creeping, run))
    found = reasons_against(creeping, replace(near, best=fits), 0.0, ACTUATOR)
    return AgainstCode.UNEXPLAINED in [note.code for note in found]


@pytest.mark.parametrize("pressure", [True, False])
def test_a_piston_that_only_yields_on_its_seals_is_explained_by_a_rough_fit(*, pressure: bool) -> None:
    assert not creeping_is_unexplained(0.7 * YIELDING_SHARE, 2.0, pressure=pressure)
    assert creeping_is_unexplained(1.5 * YIELDING_SHARE, 2.0, pressure=pressure)


def test_without_pressure_a_circuit_must_explain_half_of_a_creeping_motion() -> None:
    assert creeping_is_unexplained(0.7 * YIELDING_SHARE, 0.8, pressure=False)
    assert not creeping_is_unexplained(0.7 * YIELDING_SHARE, 0.8, pressure=True)
    assert not creeping_is_unexplained(0.7 * YIELDING_SHARE, 1.2, pressure=False)
