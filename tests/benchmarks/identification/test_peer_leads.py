"""Leads of peers are counted only for the best of each side, beyond what is allowed, and with their confidence."""

import numpy as np

from benchmarks.identification.peer_leads import PeerLeads

RNG = np.random.default_rng(3)
Y = RNG.normal(size=3000)
NOISE = RNG.normal(size=Y.size)


def test_a_sure_lead_is_told_and_counted() -> None:
    leads = PeerLeads()
    runs = {"default": Y + 1.5 * NOISE, "sippy": Y + NOISE, "jax-sysid": Y + 2.0 * NOISE, "first": Y}
    assert leads.lines(Y, runs) == ["default over sippy 1.50, 95 % interval 1.50 to 1.50"]
    assert leads.summary() == [
        "best linear peer ahead by more than 2 %: 1 of 1 tests, 1 surely; 0.0 expected if both are equally good"
    ]


def test_a_lead_by_one_stretch_is_not_sure() -> None:
    leads, late = PeerLeads(), np.zeros(Y.size)
    late[1000:1020] = 12.0
    lines = leads.lines(Y, {"default": Y + NOISE + late, "auto": Y + NOISE + late, "sysidentpy": Y + NOISE})
    assert len(lines) == 1
    (line,) = leads.summary()
    assert line.startswith("best nonlinear peer ahead by more than 10 %: 1 of 1 tests, 0 surely; 0.")


def test_runs_that_diverge_and_missing_peers_are_not_compared() -> None:
    leads = PeerLeads()
    assert leads.lines(Y, {"default": Y + NOISE, "sippy": np.full(Y.size, np.nan)}) == []
    assert leads.lines(Y, {"default": Y + NOISE, "sippy": Y + 2.0 * NOISE}) == []
    assert leads.counts["linear"].tests == 1
    assert "nonlinear" not in leads.counts
