"""A short run of the fuzzers; for long runs, see ``python -m tests.fuzz.files`` and ``tests.fuzz.texts``."""

from collections import Counter
from pathlib import Path

import numpy as np
import pytest

from tests.fuzz import bench_layouts, columns_held, files, legal_files, spellings, texts, verbs
from tests.fuzz.guard import limited
from tests.fuzz.mutations import CELLS, mutated
from tests.fuzz.seeds import KINDS


def test_a_seed_makes_the_same_mutation_again() -> None:
    first, second = (mutated(b"time_s,position_m\n0,1\n", np.random.default_rng(7), CELLS) for _ in range(2))
    assert first == second


def test_an_internal_error_is_reported_as_wrong() -> None:
    def broken() -> None:
        raise ZeroDivisionError

    assert limited(broken).startswith("ZeroDivisionError")


def test_a_few_mutated_files_and_texts_give_a_record_or_a_refusal() -> None:
    assert files.run(len(KINDS), first=1_000_000) == []  # one file in each format
    assert texts.run(15, 0, first=1_000_000) == []


def test_a_few_notations_of_one_log_give_that_log_or_a_refusal() -> None:
    assert spellings.run(12, first=1_000_000) == []


def test_a_few_files_with_columns_of_unusual_types_give_a_record_or_a_refusal() -> None:
    assert columns_held.run(4, first=1_000_000) == []


def test_a_few_legal_files_with_unusual_content_are_read_as_written(tmp_path: Path) -> None:
    assert [legal_files.check(legal_files.tdms, seed, tmp_path) for seed in legal_files.KEPT] == [""] * 3
    assert legal_files.run(5, first=1_000_000) == []  # one file from each writer


@pytest.mark.slow
def test_many_legal_files_with_unusual_content_are_read_as_written() -> None:
    ends: Counter[str] = Counter()
    assert legal_files.run(200, ends=ends) == []
    # refusals prove little, so most files must be read
    assert sum(count for end, count in ends.items() if end.endswith("read")) > 160


def test_logs_as_programs_of_benches_write_them_are_read(tmp_path: Path) -> None:
    for kind in bench_layouts.LAYOUTS:
        assert len(bench_layouts.read_unspoilt(kind, tmp_path)) == bench_layouts.N
    assert bench_layouts.run(6, first=1_000_000) == []


@pytest.mark.slow
def test_no_defect_of_a_bench_log_passes_without_a_note() -> None:
    assert bench_layouts.run(200) == []


@pytest.mark.slow
def test_every_verb_gives_an_answer_or_a_refusal_for_any_input() -> None:
    assert verbs.fuzz(100) == []


@pytest.mark.slow
def test_many_mutated_files_give_a_record_or_a_refusal() -> None:
    assert files.run(500) == []


@pytest.mark.slow
def test_many_mutated_texts_and_streams_give_an_answer_or_a_refusal() -> None:
    assert texts.run(240, 40) == []


@pytest.mark.slow
def test_no_notation_of_one_log_is_read_as_another_log() -> None:
    assert spellings.run(160) == []


@pytest.mark.slow
def test_many_files_with_columns_of_unusual_types_give_a_record_or_a_refusal() -> None:
    assert columns_held.run(80) == []
