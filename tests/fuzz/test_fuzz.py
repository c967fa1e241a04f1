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


def test_what_is_no_sentence_is_called_wrong() -> None:
    def broken() -> None:
        raise ZeroDivisionError

    assert limited(broken).startswith("ZeroDivisionError")


def test_a_few_mutated_files_and_texts_end_in_a_record_or_a_sentence() -> None:
    assert files.run(len(KINDS), first=1_000_000) == []  # one file in each format
    assert texts.run(15, 0, first=1_000_000) == []


def test_a_few_spellings_of_one_log_are_that_log_or_refused() -> None:
    assert spellings.run(12, first=1_000_000) == []


def test_a_few_files_of_columns_that_are_no_plain_numbers_end_in_a_record_or_a_sentence() -> None:
    assert columns_held.run(4, first=1_000_000) == []


def test_a_few_legal_files_with_odd_content_are_read_as_what_was_written(tmp_path: Path) -> None:
    assert [legal_files.check(legal_files.tdms, seed, tmp_path) for seed in legal_files.KEPT] == [""] * 3
    assert legal_files.run(5, first=1_000_000) == []  # one file from each writer


@pytest.mark.slow
def test_many_legal_files_with_odd_content_are_read_as_what_was_written() -> None:
    ends: Counter[str] = Counter()
    assert legal_files.run(200, ends=ends) == []
    # refusals prove little, so most files must be read
    assert sum(count for end, count in ends.items() if end.endswith("read")) > 160


def test_logs_as_programs_of_benches_write_them_are_read(tmp_path: Path) -> None:
    for kind in bench_layouts.LAYOUTS:
        assert len(bench_layouts.read_unspoilt(kind, tmp_path)) == bench_layouts.N
    assert bench_layouts.run(6, first=1_000_000) == []


@pytest.mark.slow
def test_no_mishap_of_a_log_is_passed_over_in_silence() -> None:
    assert bench_layouts.run(200) == []


@pytest.mark.slow
def test_every_verb_ends_what_it_is_given_with_an_answer_or_a_sentence() -> None:
    assert verbs.fuzz(100) == []


@pytest.mark.slow
def test_many_mutated_files_end_in_a_record_or_a_sentence() -> None:
    assert files.run(500) == []


@pytest.mark.slow
def test_many_mutated_texts_and_streams_end_in_one_sentence() -> None:
    assert texts.run(240, 40) == []


@pytest.mark.slow
def test_no_spelling_of_one_log_is_read_as_another() -> None:
    assert spellings.run(160) == []


@pytest.mark.slow
def test_many_files_of_columns_that_are_no_plain_numbers_end_in_a_record_or_a_sentence() -> None:
    assert columns_held.run(80) == []
