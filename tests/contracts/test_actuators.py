"""The contract of every kind of actuator in the registry (docs/add-a-plant.md)."""

import json
import math
from collections.abc import Mapping
from dataclasses import dataclass, fields, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from typer.testing import CliRunner

from estimation.finding import Finding, Gate, Outcome
from experiments import actuators as registry
from experiments.actuator_kind import ActuatorKind, Run
from experiments.actuators import actuator, actuators
from experiments.cli import app
from experiments.command.json_output import json_text
from experiments.log_pages.finding_page import finding_page
from experiments.page.names_shown import quantity_name
from faults.notes import ClassCode
from plant.eha.rig import read_rig, rig_template
from plant.errors import HydrostateError
from plant.log.columns import UNITS
from plant.log.files import read_record, write_record
from plant.log.record import Record
from plant.notes import Note
from plant.units import notes, unit_registry

KINDS = {kind.name: kind for kind in actuators()}
EVERY_KIND = pytest.mark.parametrize("kind", KINDS.values(), ids=KINDS)

SHORT: Mapping[str, Mapping[str, Any]] = {
    "eha": {"duration": 4.0, "sample_time": 1e-3},
    "diaphragm-motor": {"duration": 0.15},
}
"""Options that shorten a run of a kind whose default run is long."""

LOADED: Mapping[str, Mapping[str, Any]] = {"diaphragm-motor": {"load": 10.0}}
"""Load on the motor in these runs [N]; other tests use the same load, so its fault curves, which take seconds to
simulate, are computed only once."""

FOREIGN = {"eha": ("--load", "3")}
"""An option that the kind does not accept."""


def run_of(kind: ActuatorKind, seed: int = 3) -> Run:
    assert kind.simulate is not None
    own = {**SHORT.get(kind.name, {}), **LOADED.get(kind.name, {})}
    options = {**kind.simulate.options, **own, "seed": seed, "plant": kind.name}
    return kind.simulate.run(kind.rig, options)


@dataclass(frozen=True)
class Looked:
    """The findings of a kind on a log of its healthy actuator, read from a file."""

    kind: ActuatorKind
    log: Path
    record: Record
    findings: Mapping[str, Finding]


@pytest.fixture(scope="module", params=KINDS)
def looked(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Looked:
    kind = KINDS[request.param]
    log = tmp_path_factory.mktemp(kind.name) / "healthy.csv"
    write_record(run_of(kind).record, log)
    record = read_record(log, required=kind.required)
    findings: dict[str, Finding] = {}
    for name, verb in (("estimate", kind.estimate), ("diagnose", kind.diagnose)):
        if verb is not None:
            findings[name] = verb.run(
                record, *verb.prepare(kind.rig, {**verb.options, **LOADED.get(kind.name, {}), "seed": 0})
            )
    return Looked(kind, log, record, findings)


@EVERY_KIND
def test_a_kind_of_actuator_is_found_by_its_name_and_by_its_models(kind: ActuatorKind) -> None:
    assert all(actuator(name) is kind for name in (kind.name, *kind.models))
    assert kind.description
    assert kind.simulate
    assert kind.estimate
    assert kind.diagnose


@EVERY_KIND
def test_parameters_have_notes_and_are_read_back_from_a_rig_file(kind: ActuatorKind, tmp_path: Path) -> None:
    assert list(notes(kind.parameters)) == [one.name for one in fields(kind.parameters)]
    path = tmp_path / "rig.toml"
    path.write_text(rig_template(kind.parameters, kind.name, {}), encoding="utf-8")
    assert kind.read_rig(path).parameters == kind.rig.parameters == kind.parameters()
    other = next(one for one in KINDS.values() if one is not kind)
    text = f'plant = "{other.name}"\n'
    path.write_text(text, encoding="utf-8")
    with pytest.raises(
        HydrostateError, match=f"a rig of plant '{kind.name}' is needed here, got one of '{other.name}'"
    ):
        read_rig(path, kind.parameters, kind.name)


@EVERY_KIND
def test_channels_of_a_kind_are_known_and_include_the_required_ones(kind: ActuatorKind) -> None:
    assert {name: UNITS[name] for name in kind.channels} == dict(kind.channels)
    assert {name for wanted in kind.required for name in wanted.split(" or ")} <= set(kind.channels)
    assert kind.required


@EVERY_KIND
def test_the_same_seed_gives_the_same_run_and_every_required_channel_is_logged(kind: ActuatorKind) -> None:
    first, again, other = (run_of(kind, seed).record for seed in (3, 3, 4))
    assert all(np.array_equal(first[name], again[name]) for name in first)
    assert not all(np.array_equal(first[name], other[name]) for name in first)
    assert all(any(name in first for name in wanted.split(" or ")) for wanted in kind.required)
    assert set(first) <= set(kind.channels)
    assert json.loads(json.dumps(dict(first.metadata)))["plant"]


def test_a_finding_has_an_outcome_a_gate_channels_and_ordered_intervals(looked: Looked) -> None:
    for found in looked.findings.values():
        assert found.actuator == looked.kind.name
        assert isinstance(found.outcome, Outcome)
        assert isinstance(found.gate, Gate)
        assert set(found.channels) <= set(looked.record)
        assert found.channels
        assert all(isinstance(note, Note) and str(note) for note in found.all_notes)
        for one in {**found.quantities, **found.severities}.values():
            unit_registry().parse_units(one.unit)
            assert one.ci95 is None or one.value is not None
            if one.value is not None and one.ci95 is not None and all(map(math.isfinite, one.ci95)):
                assert one.ci95[0] <= one.value <= one.ci95[1]


def test_a_simulated_healthy_log_is_estimated_and_diagnosed_as_healthy(looked: Looked) -> None:
    estimate, diagnosis = looked.findings["estimate"], looked.findings["diagnose"]
    assert estimate.outcome is Outcome.OK
    assert estimate.gate.passed
    assert any(one.value is not None and one.ci95 is not None for one in estimate.quantities.values())
    assert (diagnosis.condition, diagnosis.unknown) == (looked.kind.conditions[0], False)
    assert set(diagnosis.probabilities) <= set(looked.kind.conditions)
    beside = sum(note.data["percent"] for note in diagnosis.not_told if note.code == ClassCode.STUCK_NOT_TOLD)
    assert sum(diagnosis.probabilities.values()) + 0.01 * beside == pytest.approx(float(bool(diagnosis.probabilities)))


def test_entries_of_a_finding_equal_those_of_a_failed_log_and_are_valid_json(looked: Looked) -> None:
    for name, found in looked.findings.items():
        verb = getattr(looked.kind, name)
        entries = verb.entries(found)
        about = {"outcome", "message", "warnings", "condition", "expected", "rig", "seed", "plant"}
        assert set(verb.blank) - set(entries) <= about
        assert set(entries) - set(verb.blank) <= about
        assert json.loads(json_text([entries]))[0]["outcome"] == found.outcome.value


def test_the_page_shows_every_quantity_found(looked: Looked) -> None:
    for name, found in looked.findings.items():
        result = {"file": "run.csv", "rig": "mine", **getattr(looked.kind, name).entries(found)}
        page = finding_page(result, found, looked.record)
        assert all(quantity_name(one) in page for one in found.quantities)
        assert found.channels[0] in page
        assert "rig mine" in page


def test_the_diagnose_command_finds_the_healthy_condition(looked: Looked) -> None:
    load = [f"--{name}={value}" for name, value in LOADED.get(looked.kind.name, {}).items()]
    done = CliRunner().invoke(app, ["diagnose", "--plant", looked.kind.name, *load, "--json", str(looked.log)])
    assert done.exit_code == 0, done.output
    (entries,) = json.loads(done.stdout)
    assert entries["condition"] == looked.kind.conditions[0]
    assert entries["plant"] == looked.kind.name


@EVERY_KIND
def test_foreign_options_and_missing_columns_are_refused_in_one_sentence(kind: ActuatorKind, tmp_path: Path) -> None:
    run = run_of(kind)
    lacking = next(name for wanted in kind.required for name in wanted.split(" or "))
    log = tmp_path / "log.csv"
    write_record(run.record.replace(**{lacking: None}), log)
    option = FOREIGN.get(kind.name, ("--form", "flow"))
    for words, said in ((option, f"{option[0]} needs --plant"), ((), f"column {lacking} is missing")):
        done = CliRunner().invoke(app, ["estimate", "--plant", kind.name, *words, str(log)])
        assert done.exit_code == 2
        assert said in done.stderr
        assert len(done.stderr.splitlines()) == 1


def test_a_verb_that_is_not_available_for_a_kind_is_refused(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    bare = replace(KINDS["piezo-stack"], estimate=None)
    monkeypatch.setattr(registry, "actuator", lambda _: bare)
    done = CliRunner().invoke(app, ["estimate", "--plant", "piezo-stack", str(tmp_path / "log.csv")])
    assert done.exit_code == 2
    assert "estimate is not available for piezo-stack" in done.stderr


def test_an_unknown_kind_is_refused_with_those_that_are_known() -> None:
    with pytest.raises(HydrostateError, match="--plant must be one of eha, reduced, lumped, circuit, piezo-stack"):
        actuator("toy")


def test_a_rig_file_selects_its_kind_of_actuator(tmp_path: Path) -> None:
    rig, out = tmp_path / "rig.toml", tmp_path / "run.csv"
    run = CliRunner()
    assert run.invoke(app, ["rig", "init", str(rig), "--plant", "diaphragm-motor"]).exit_code == 0
    done = run.invoke(app, ["simulate", "--rig", str(rig), "--duration", "0.02", "--out", str(out), "--json"])
    assert done.exit_code == 0, done.output
    assert json.loads(done.stdout)[0]["plant"] == "diaphragm-motor"
    refused = run.invoke(app, ["identify", "--rig", str(rig), str(out)])
    assert refused.exit_code == 2
    assert "a rig of plant 'eha' is needed here" in refused.stderr
