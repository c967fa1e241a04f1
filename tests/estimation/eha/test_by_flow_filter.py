"""The flow form, online: without being told the condition it finds bulk modulus and leakage."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from estimation.eha.by_flow_filter import filter_flow, mixture
from estimation.engine.contract import Trace
from estimation.models.eha_forms import BULK_MODULUS
from faults.conditions import CONDITIONS, parameters_for
from plant.eha.drives import make_drive
from plant.eha.model import EhaParameters
from plant.eha.simulate import LUMPED, simulate
from plant.errors import LogError
from plant.log.files import read_record
from plant.log.record import Record
from plant.sensors.sensors import BENCH

HEALTHY = EhaParameters()


def run(condition: str, drive: str = "prbs") -> tuple[Record, EhaParameters]:
    p, rng = parameters_for(CONDITIONS[condition]), np.random.default_rng(2)
    return simulate(LUMPED, make_drive(drive, 10.0, 1e-3, p, rng), 1e-3, p, sensors=BENCH, rng=rng), p


def trace(mean: float, variance: float, log_likelihood: float) -> Trace:
    one = np.array([mean])
    return Trace(
        mean=one,
        covariance=np.array([[variance]]),
        track=one[None],
        track_variance=np.array([[variance]]),
        nis=np.zeros(1),
        count=np.zeros(1),
        log_likelihood=log_likelihood,
        residuals=np.empty((0, 1)),
        residual_variances=np.empty((0, 1)),
    )


def test_a_mixture_has_the_moments_of_its_parts() -> None:
    mixed = mixture([trace(0.0, 1.0, 5.0), trace(4.0, 3.0, 5.0)])
    assert mixed.mean[0] == pytest.approx(2.0)
    assert mixed.covariance[0, 0] == pytest.approx(2.0 + 4.0)
    assert mixed.track_variance[0, 0] == pytest.approx(2.0 + 4.0)


def test_weights_are_likelihoods_and_what_diverged_has_none() -> None:
    parts = [trace(0.0, 1.0, -1e4), trace(1.0, 1.0, -1e4 + np.log(3.0)), trace(np.nan, 1.0, 1e9)]
    assert mixture(parts).mean[0] == pytest.approx(0.75)
    assert np.isnan(mixture([trace(np.nan, 1.0, np.nan)] * 2).mean[0])


@pytest.mark.parametrize("condition", ["normal", "minor_leakage", "major_leakage_major_friction"])
def test_it_finds_bulk_modulus_and_leakage_without_being_told_the_condition(condition: str) -> None:
    record, truth = run(condition)
    estimate = filter_flow(record, HEALTHY)
    assert estimate.settled(BULK_MODULUS, 0.02)[0] == pytest.approx(truth.bulk_modulus, rel=0.02)
    assert estimate.settled("leakage_coefficient", 0.02)[0] == pytest.approx(truth.leakage_coefficient, rel=0.15)


def test_missing_samples_and_a_drop_out_do_not_move_it() -> None:
    record, truth = run("minor_leakage")
    gone = np.random.default_rng(5).random(len(record)) < 0.01
    gone[5000:5100] = True
    holed = record.replace(differential_pressure_pa=np.where(gone, np.nan, record["differential_pressure_pa"]))
    assert filter_flow(holed, HEALTHY).settled(BULK_MODULUS, 0.02)[0] == pytest.approx(truth.bulk_modulus, rel=0.02)


def test_a_log_without_position_is_refused_by_name() -> None:
    record, _ = run("normal")
    with pytest.raises(LogError, match="lacks position_m"):
        filter_flow(record.replace(position_m=None), HEALTHY)


def test_a_rig_without_leakage_is_no_obstacle() -> None:
    record, truth = run("normal")
    tight = replace(HEALTHY, leakage_coefficient=0.0, flow_bias=0.0)
    assert np.isfinite(filter_flow(record, tight).settled(BULK_MODULUS, 0.02)[0])
    assert truth.bulk_modulus > 0.0


@pytest.mark.slow
def test_on_the_foreign_bench_it_is_within_five_percent_on_every_log(shared: Path) -> None:
    truth = pd.read_csv(shared / "bench" / "truth.csv")
    for row in truth.itertuples():
        estimate = filter_flow(read_record(shared / "bench" / str(row.file)), HEALTHY)
        assert estimate.settled(BULK_MODULUS, 0.02)[0] == pytest.approx(row.bulk_modulus_pa, rel=0.05), row.file
