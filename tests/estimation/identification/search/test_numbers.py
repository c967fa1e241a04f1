"""Criteria and first guesses of small records, kept in `numbers.json`; loops run as plain Python."""

from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np
import pytest

from estimation.identification.search import pole_search, starts
from estimation.identification.search.banded import explained_power, refine_banded
from estimation.identification.search.criterion import (
    Structure,
    predict,
    profile,
    sensitivities,
)
from estimation.identification.search.experiments import data_hash, experiments_from, signal_list
from estimation.identification.search.noise_model import noise_start
from tests.estimation.identification.search.made_answers import NOISE, WEIGHT, F, U, answer
from tests.kernels import loops_in_python
from tests.numbers import Numbers, refused, some

NUMBERS = Numbers(__file__)


@NUMBERS.case()
def sensitivities_and_profiles() -> dict[str, Any]:
    told: dict[str, Any] = {}
    for name, form in {
        "strictly proper": Structure(2, 2, 1),
        "late": Structure(1, 2, 3),
        "longer numerator": Structure(4, 1, 0),
        "at rest": Structure(2, 2, 1, estimate_initial_state=False),
    }.items():
        theta = np.linspace(-0.3, 0.4, form.n_parameters)
        f = np.concatenate([[1.0], F[1 : 1 + form.n_denominator]])
        cost, values = profile(form, f, U, answer(), WEIGHT > 0.0)
        columns = sensitivities(form, theta, U)
        told[name] = {
            "sizes": [form.n_states, form.n_main, form.n_initial, form.n_parameters, *form.sizes.tolist()],
            "output": some(predict(form, theta, U)),
            "slopes": [some(column) for column in columns.T],
            "profiled": [cost, values],
        }
    return told


@NUMBERS.case()
def banded_criterion() -> dict[str, Any]:
    omega = np.geomspace(0.05, 3.0, 12)
    shift = np.exp(-1j * omega)
    truth = (0.3 * shift - 0.1 * shift**2) / (1.0 - 1.5 * shift + 0.7 * shift**2)
    power = np.linspace(2.0, 0.5, 12)
    cross = truth * power * (1.0 + 0.05 * np.cos(np.arange(12)))
    rows = np.array([F[1:], [-0.9, 0.2], [-1.2, 0.9]])
    told: dict[str, Any] = {}
    with loops_in_python():
        for n_b, delay in ((2, 1), (1, 0), (3, 0), (1, 3)):
            explained, numerators = explained_power(rows, n_b, delay, omega, power, cross)
            told[f"{n_b} coefficients behind {delay}"] = [explained, numerators]
        onto = np.array([0.0, 0.7])
        told["a pole at a band"] = [*explained_power(np.array([[-1.0]]), 1, 0, onto, power[:2], cross[:2])]
        narrow = explained_power(rows, 3, 0, omega[:1], power[:1], cross[:1])
        told["one band"] = narrow[0]
        for most in (1, 2, 4, 25):
            begin = np.array([[0.3, -0.1, -1.4, 0.6], [0.1, 0.1, -0.9, 0.2], [0.2, 0.0, -1.2, 0.9]])
            costs, refined = refine_banded(begin, 2, 1, omega, power, cross, most)
            told[f"refined by {most}"] = [costs, refined]
        costs, refined = refine_banded(np.array([[0.1, 0.05, -0.5]]), 2, 0, omega, power, cross, 6)
        told["first order"] = [costs, refined]
        costs, refined = refine_banded(np.array([[0.1, -1.98, 0.985]]), 1, 2, omega, power, cross, 9)
        told["at the circle"] = [costs, refined]
    return told


@NUMBERS.case()
def pole_places() -> dict[str, Any]:
    spectra = pole_search.banded_spectra([(U, answer()), (U[:90], answer()[:90])])
    singles, pairs = pole_search._real_poles(200), pole_search._pole_pairs(200)
    told: dict[str, Any] = {
        "bands": [spectra.omega.size, some(spectra.omega, 9), some(spectra.power, 9), some(spectra.cross, 9)],
        "of a long record": some(pole_search.banded_spectra([(np.tile(U, 10), np.tile(answer(), 10))]).power, 9),
        "real poles": [singles.size, some(singles[:7, 0], 7), some(singles[7:, 0])],
        "pairs": [len(pairs), some(pairs[:, 0], 9), some(pairs[:, 1], 9), some(pairs[192:, 0], 4)],
        "products": pole_search._multiplied(np.array([[0.5], [0.1]]), np.array([[-1.0, 0.2], [0.3, 0.4]])),
    }
    ranked = np.array([[-0.9, 0.0], [-0.905, 0.0], [-0.93, 0.0], [-1.8, 0.9], [-1.2, 1.1], [-1.8, 0.82], [-0.5, 0.1]])
    told["distinct"] = [pole_search._distinct(ranked, count) for count in (1, 3, 9)]
    none = np.array([[-0.5, 0.1]])
    told["far down the list"] = [
        len(pole_search._distinct(np.concatenate([np.tile([-1.2, 1.1], (k, 1)), none]), 1)) for k in (10, 11, 12, 30)
    ]
    for form in (Structure(2, 1, 0), Structure(2, 2, 1), Structure(2, 3, 0)):
        costs, thetas = pole_search.search_poles(form, spectra, 200)
        told[f"order {form.n_denominator}"] = [len(costs), costs[:6], thetas[:2], some(costs, 3)]
    peaks = pole_search._single_candidates(Structure(1, 1, 0), np.empty((1, 0)), singles, spectra)
    told["peaks"] = [len(peaks[0]), peaks[1]]
    rough = np.array([[-0.8], [-0.8001], [-0.2], [0.9]])
    told["refined"] = [*pole_search.refine(Structure(2, 1, 0), rough, spectra)]
    return told


@NUMBERS.case()
def first_guesses() -> dict[str, Any]:
    y = answer(0.2)
    told: dict[str, Any] = {}
    for name, sizes in {"ARX": (2, 2, 1), "late": (1, 2, 3), "long": (4, 1, 0)}.items():
        told[name] = [*starts.least_squares_arx(*sizes, U, y)]
    told["reduced"] = [starts.reduced_high_order_arx(n, U, y) for n in (1, 2, 3)]
    long = np.tile(U, 9)
    told["reduced, of a long record"] = starts.reduced_high_order_arx(2, long, answer(1.0, long))
    told["reduced, of a short one"] = starts.reduced_high_order_arx(2, U[:50], y[:50])
    data = experiments_from([U[:70], U[70:]], [y[:70], y[70:]], ("u", "y"), n_excited=4, n_wanted=20).scaled()
    found = starts.starting_values(Structure(2, 2, 1), data, 8)
    told["starts"] = [len(found), found[0], found[1], len(starts.starting_values(Structure(2, 2, 1), data, 3))]
    near = np.array([[1.0, 2.0], [1.0, 2.000002], [1.0, 2.000007], [1.0, 2.0]])
    told["without twins"] = len(starts._without_twins(near))
    told["noise"] = [
        part for n_c, n_d in ((1, 1), (2, 0), (0, 2), (3, 1), (0, 0)) for part in noise_start(y - answer(0.0), n_c, n_d)
    ]
    walk = np.cumsum(NOISE)
    told["noise that wanders"] = [*noise_start(walk, 1, 2), *noise_start(np.tile(walk, 4), 1, 1)]
    told["noise of few samples"] = [*noise_start(walk[:25], 1, 1)]
    return told


@NUMBERS.case()
def experiments() -> dict[str, Any]:
    y = answer()
    lost = np.where(WEIGHT > 0.0, y, np.nan)
    names = ("u", "y")
    two = experiments_from([U[:70], U[70:]], [lost[:70], lost[70:]], names, n_excited=4, n_wanted=20)
    scaled = two.scaled()
    told: dict[str, Any] = {
        "counts": [two.count, two.n_used, two.longest.start, two.longest.stop, two.bounds],
        "scales": [scaled.u_scale, scaled.y_scale, some(scaled.u, 3), some(scaled.y, 3)],
        "bridged": [some(one, 12) for _, one in two.bridged()],
        "hashes": [data_hash(two, 0.01), data_hash(experiments_from(U, y, names, n_excited=1, n_wanted=1), 0.02)],
        "listed": [len(signal_list(U)), len(signal_list([U, U])), len(signal_list([1.0, 2.0])), len(signal_list([]))],
    }
    sine = np.sin(0.3 * np.arange(200.0))
    tiny = sine + 3e-9 * NOISE
    calls: dict[str, Callable[[], Any]] = {
        "too few": partial(experiments_from, U, lost, names, n_excited=1, n_wanted=int(WEIGHT.sum()) + 1),
        "just enough": partial(experiments_from, U, lost, names, n_excited=1, n_wanted=int(WEIGHT.sum())),
        "more outputs": partial(experiments_from, [U], [y, y], names, n_excited=1, n_wanted=1),
        "other lengths": partial(experiments_from, U, y[:9], names, n_excited=1, n_wanted=1),
        "a table": partial(experiments_from, U[:, None], y[:, None], names, n_excited=1, n_wanted=1),
        "one without outputs": partial(experiments_from, [U, U], [y, y * np.nan], names, n_excited=1, n_wanted=1),
        "a constant output": partial(experiments_from, U, np.ones(200), names, n_excited=1, n_wanted=1),
        "a constant input": partial(experiments_from, np.ones(200), y, names, n_excited=1, n_wanted=1),
        "no input": partial(experiments_from, [U[:0]], [y[:0]], names, n_excited=1, n_wanted=0),
        "lost inputs": partial(experiments_from, lost, y, names, n_excited=1, n_wanted=1),
        "endless outputs": partial(experiments_from, U, np.where(U > 0, y, np.inf), names, n_excited=1, n_wanted=1),
        "a sine for two": partial(experiments_from, sine, y, names, n_excited=2, n_wanted=1),
        "a sine for three": partial(experiments_from, sine, y, names, n_excited=3, n_wanted=1),
        "a sine beside steps": partial(experiments_from, [sine, U], [y, y], names, n_excited=3, n_wanted=1),
        "a sine with a trace of noise": partial(experiments_from, tiny, y, names, n_excited=3, n_wanted=1),
        "as short as may be": partial(experiments_from, NOISE[:8], y[:8], names, n_excited=4, n_wanted=1),
        "shorter": partial(experiments_from, NOISE[:7], y[:7], names, n_excited=4, n_wanted=1),
    }
    return told | {"refused": {name: refused(call) for name, call in calls.items()}}


@pytest.mark.parametrize("case", NUMBERS.cases)
def test_kept_numbers_are_unchanged(case: str) -> None:
    NUMBERS.check(case)
