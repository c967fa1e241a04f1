"""Logs as free-run fits use them: scaled, cut, split at gaps, kept in `numbers_data.json`."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np
import pytest

from estimation.identification.free_run import from_records
from estimation.identification.free_run.data import blocks, channels_from, in_scale, liveliest_sections, scaled
from plant.log.record import Record
from tests.estimation.identification.free_run.made_channels import NOISE, N, U, answer, channels
from tests.numbers import Numbers, refused, some, warned

NUMBERS = Numbers(__file__)


@NUMBERS.case()
def data_that_are_cut() -> dict[str, Any]:
    one = channels(lost=True)
    whole, by = scaled(one)
    lively = replace(one, u=tuple(u * np.linspace(0.1, 3.0, len(u))[:, None] for u in one.u))
    few = replace(one, u=(one.u[0][:3],), y=(NOISE[:3],))
    told: dict[str, Any] = {
        "counts": [one.n_samples, one.longest, one.duration],
        "scaling": [by.u_mean, by.u_std, by.y_mean, by.y_std],
        "scaled": [some(part, 3) for part in (*whole.u, *whole.y)],
        "back in scale": some(in_scale(one, by).y[1], 3),
        "blocks": [[np.flatnonzero(mask)[[0, -1]] for mask in masks] for masks in blocks(one, 4)],
        "blocks of few": [mask.tolist() for masks in blocks(few, 2) for mask in masks],
    }
    for most in (100, 299, 300, 3):
        part = liveliest_sections(lively, most)
        told[f"section of {most}"] = [[u[0, 0], len(u)] for u in part.u]
    make = partial(channels_from, sample_time=0.1, inputs=("a",), output="y")
    calls: dict[str, Callable[[], Any]] = {
        "19 samples": partial(make, [U[:19, :1]], [NOISE[:19]]),
        "20 samples": partial(make, [U[:20, :1]], [NOISE[:20]]),
        "more logs": partial(make, [U[:, :1]], [NOISE, NOISE]),
        "no logs": partial(make, [], []),
        "other lengths": partial(make, [U[:30, :1]], [NOISE[:31]]),
        "more inputs": partial(make, [U], [NOISE]),
        "lost inputs": partial(make, [U[:, :1] * np.nan], [NOISE]),
        "endless outputs": partial(make, [U[:, :1]], [NOISE + np.inf]),
        "a constant input": partial(make, [0.0 * U[:, :1]], [NOISE]),
        "a constant output": partial(make, [U[:, :1]], [0.0 * NOISE]),
        "no time": partial(channels_from, [U[:, :1]], [NOISE], 0.0, ("a",), "y"),
        "endless time": partial(channels_from, [U[:, :1]], [NOISE], np.inf, ("a",), "y"),
    }
    return told | {"refused": {name: refused(call) for name, call in calls.items()}}


@NUMBERS.case()
def logs_with_gaps() -> dict[str, Any]:
    told: dict[str, Any] = {}
    wave = np.cumsum(NOISE) * 0.1
    quiet = np.sin(np.arange(N) / 80.0)
    holes: dict[str, Sequence[slice]] = {
        "one hole": [slice(100, 130)],
        "both ends": [slice(0, 7), slice(290, N)],
        "a short part": [slice(100, 103), slice(122, 160)],
        "a shorter part": [slice(100, 103), slice(123, 160)],
        "one sample": [slice(150, 151)],
    }
    for name, lost in holes.items():
        for which, series in (("lively", wave), ("quiet", quiet)):
            u = series.copy()
            for part in lost:
                u[part] = np.nan
            record = Record(0.1, {"a": u, "y": answer(two=False)})
            parts = from_records.pieces(record, ["a"])
            told[f"{name}, {which}"] = [[round(part.start_time, 6), len(part)] for part in parts]
            told[f"{name}, {which}, unknown"] = int(from_records._unbridged_samples(u).sum())
    u = np.where((np.arange(N) > 99) & (np.arange(N) < 130), np.nan, wave)
    record = Record(0.1, {"a": u, "y": answer(two=False)})
    found = from_records.channels_of([record], ["a"], "y", split=True)
    told["split"] = [[len(y), int(np.isnan(y).sum())] for y in found.y]
    told["not split"] = some(from_records.channels_of([record], ["a"], "y").u[0], 9)
    told["at another time"] = [
        from_records.channels_of([record], ["a"], "y", wanted).u[0].size for wanted in (0.1, 0.10009, 0.1002, 0.2)
    ]
    told["spoilt"] = [from_records._bridging_error(wave, length) for length in (1, 3, 20, 298, 299, 400)]
    told["spoilt, a constant"] = from_records._bridging_error(np.ones(9), 2)
    told["warns"] = [
        warned(partial(from_records.channels_of, [record], ["a"], "y", split=split)) for split in (True, False)
    ]
    told["refused"] = refused(lambda: from_records.channels_of([record], ["y"], "y"))
    return told


@pytest.mark.parametrize("case", NUMBERS.cases)
@pytest.mark.filterwarnings("ignore::plant.errors.LogWarning", "ignore::plant.errors.CovarianceWarning")
def test_kept_numbers_are_unchanged(case: str) -> None:
    NUMBERS.check(case)
