"""The identifiability card: what a drive and its sensors would determine, in numbers and in sentences."""

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from estimation.arrays import Array
from estimation.log_checks.channel_names import PRESSURE

OBSERVABLE = 0.03
"""Relative standard deviation above which a parameter is called not observable (errata E13) [fraction]."""

INSEPARABLE = 0.95
"""Correlation of two estimates above which they are called hard to tell apart [dimensionless]."""


MOST_PAIRS = 3
"""Largest number of pairs of parameters that a card names as hard to tell apart [count]."""


@dataclass(frozen=True, eq=False)
class Card:
    """Identifiability card: what a drive and its sensors would determine.

    Parameters
    ----------
    relative_std : Mapping[str, float]
        Least relative standard deviation of each unknown [fraction]; 1 means that nothing is learnt.
    known_exactly : Mapping[str, float]
        The same if the rig file's uncertain parameters were known exactly [fraction].
    correlation : ndarray, shape (unknowns, unknowns)
        Correlation of the estimates.
    friction_force : float
        Least relative standard deviation of the friction force at the highest speed of the piston [fraction].
    weakest : Mapping[str, float]
        Weights of the least determined combination of logarithms [dimensionless].
    weakest_std : float
        Its standard deviation [fraction].
    stuck : float
        Share of the run during which the piston sticks [fraction].
    uncertainties : Mapping[str, float]
        Relative standard deviations of the parameters taken as known [fraction].
    """

    channels: tuple[str, ...]
    unknowns: tuple[str, ...]
    relative_std: Mapping[str, float]
    known_exactly: Mapping[str, float]
    correlation: Array
    friction_force: float
    weakest: Mapping[str, float]
    weakest_std: float
    stuck: float
    uncertainties: Mapping[str, float]

    @property
    def overall(self) -> float:
        """Geometric mean of the relative standard deviations [fraction], by which drives are ranked."""
        return float(np.exp(np.mean(np.log([max(std, 1e-12) for std in self.relative_std.values()]))))


def rank_drives(cards: Mapping[str, Card], parameter: str | None = None) -> list[str]:
    """Return drives by how much they determine, the best first.

    Parameters
    ----------
    cards : Mapping[str, Card]
        The card of each drive, by its name.
    parameter : str, optional
        The parameter that counts; by default all unknowns equally, by the geometric mean of their bounds.
    """
    return sorted(
        cards, key=lambda name: cards[name].overall if parameter is None else cards[name].relative_std[parameter]
    )


def _in_words(name: str) -> str:
    return name.replace("_", " ")


def percent(value: float) -> str:
    """Return a fraction as a percentage with two digits.

    Parameters
    ----------
    value : float
        The fraction [dimensionless].

    Examples
    --------
    >>> percent(0.00042), percent(0.11), percent(0.997), percent(1.02)
    ('0.042 %', '11 %', 'over 99 %', '102 %')
    """
    if 0.99 <= value < 1.0:
        return "over 99 %"
    return f"{100.0 * value:.0f} %" if value >= 0.99 else f"{100.0 * value:.2g} %"


def sentences(card: Card) -> tuple[str, ...]:
    """Return the meaning of a card in sentences."""
    said: list[str] = []
    lost = [name for name, std in card.relative_std.items() if std > OBSERVABLE]
    if lost:
        named = ", ".join(f"{_in_words(name)} ({percent(card.relative_std[name])})" for name in lost)
        said.append(f"not observable with this drive and these sensors (bound over {percent(OBSERVABLE)}): {named}")
    if card.stuck > 0.5:
        said.append(
            f"the piston sticks for {percent(card.stuck)} of the time; while it sticks, position and velocity say "
            "nothing about bulk modulus (errata E13)"
            + (
                ", and only differential pressure does"
                if PRESSURE in card.channels
                else ": log differential pressure, or drive with larger, slower steps"
            )
        )
    said += _inseparable_sentences(card)
    if len(card.unknowns) > 1 and card.weakest_std > OBSERVABLE:
        largest = max(abs(weight) for weight in card.weakest.values())
        terms = [
            f"{weight:+.2f} {_in_words(name)}" for name, weight in card.weakest.items() if abs(weight) > 0.2 * largest
        ]
        said.append(f"the combination known worst, to {percent(card.weakest_std)}: {' '.join(terms)} (of logarithms)")
    said += _rig_sentences(card)
    return tuple(said)


def _inseparable_sentences(card: Card) -> list[str]:
    """Return a sentence on each of the pairs that are hardest to tell apart, if it matters."""
    pairs: list[tuple[float, str]] = []
    for i, first in enumerate(card.unknowns):
        for j, second in enumerate(card.unknowns[:i]):
            correlation = float(card.correlation[i, j])
            whole = card.relative_std[first]
            if abs(correlation) < INSEPARABLE or max(whole, card.relative_std[second]) < 0.1 * OBSERVABLE:
                continue
            sure = whole * math.sqrt(max(0.0, 1.0 - correlation**2))
            said = (
                f"{_in_words(second)} and {_in_words(first)} are hard to tell apart (correlation {correlation:.2f}): "
                f"with {_in_words(second)} known, {_in_words(first)} would be known to {percent(sure)}, "
                f"not {percent(whole)}"
            )
            pairs.append((-abs(correlation), said))
    return [said for _, said in sorted(pairs)[:MOST_PAIRS]]


def _rig_sentences(card: Card) -> list[str]:
    if "bulk_modulus" not in card.unknowns:
        return []
    rule = "a log determines only the ratio of chamber volume to bulk modulus"
    if not card.uncertainties:
        return [
            f"{rule}: an error of 1 % in the volume is an error of 1 % in bulk modulus; these bounds take the volume "
            "as exact unless chamber_volume is listed under [uncertainty] in the rig file"
        ]
    given = ", ".join(f"{_in_words(name)} {percent(std)}" for name, std in card.uncertainties.items())
    whole, alone = card.relative_std["bulk_modulus"], card.known_exactly["bulk_modulus"]
    return [
        f"{rule}: with what the rig file leaves uncertain ({given}) its bound is {percent(whole)}, "
        f"without {percent(alone)}"
    ]
