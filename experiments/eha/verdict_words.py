"""A diagnosis in words, made from its entries: lines for a terminal, clauses for a page."""

import math
from collections.abc import Mapping, Sequence
from typing import Any

from experiments.command.visible_text import visible_name
from experiments.log_pages.screens import NEXT_LINE
from experiments.page.condition_names import condition_in_words
from experiments.page.numbers import decimals_of, percent_text, shop_unit
from experiments.page.sentences import sentence
from faults.diagnosis.beyond_nine.left_open import LEAST_REPORTED
from faults.notes import AgainstCode

SEVERITY_NAMES = {
    "leakage_flow": "leakage at rated pressure",
    "velocity_lost": "velocity lost",
    "added_friction": "friction added at rated speed",
    "pressure_rise": "pressure rise",
    "bulk_modulus": "bulk modulus",
    "entrained_air": "entrained air, at most",
}
"""Displayed name of each severity."""

MARGINS = ((1.05, "too close to call"), (1.25, "narrow"), (2.0, "clear"), (math.inf, "wide"))
"""Words for the ratio of the runner-up's score to the best, up to each bound [dimensionless]."""

LEVELS_IN_WORDS = {"none": "normal", "minor": "minor", "major": "major"}
"""Displayed name of each level of leakage or friction."""

MOST_DECIMALS = 3
"""Maximum number of decimals of a severity [count]."""

EQUALLY_LIKELY_RATIO = 0.99
"""Minimum ratio of a condition's probability to the likeliest's at which both count as equally likely [fraction]: the
log has no information that separates them, and calibrated probabilities are not known more precisely."""

NEAREST_WORDS = "UNKNOWN: none of the nine conditions fits; the nearest is "
"""Beginning of a verdict with evidence against it."""

STILL_WORDS = "UNKNOWN: the piston stands still, which several conditions and a blocked rod explain; the likeliest is "
"""The same where the conditions fit, but a blocked rod does too."""

OUTSIDE_WORDS = "none of the nine conditions"
"""Label of the probability left over by all nine conditions, for a fault that the log does not exclude."""


def verdict_lines(result: Mapping[str, Any]) -> list[str]:
    """Return the lines on a log for a reader.

    Returns
    -------
    list[str]
        The verdict, the same for a mechanic, the severity of leakage, friction and oil, whether it is reliable, what to
        do next, and the result of the library of transfer functions if there is one.
    """
    from experiments.eha.plain_verdict import is_doubted, verdict  # here, since estimates do not need it

    library = library_sentence(result)
    return [
        f"{visible_name(result['file'])}: {headline(result)}",
        f"  verdict   {verdict(result)}",
        *(
            ["  numbers   do not rely on them: they are those of the nearest model, which does not fit the log"]
            if is_doubted(result)
            else []
        ),
        f"  leakage   {severities_text(result, ('leakage_flow', 'velocity_lost'))}",
        f"  friction  {severities_text(result, ('added_friction', 'pressure_rise'))}",
        f"  oil       {severities_text(result, ('bulk_modulus',))}",
        f"  reliable  {reliability_text(result)}",
        f"  next      {next_step(result)}",
        *([f"  {library}"] if library else []),
    ]


def headline(result: Mapping[str, Any]) -> str:
    """Return the verdict in one sentence.

    Returns
    -------
    str
        Condition and probability, or unknown; and since when. If the log does not separate some conditions, what they
        share, and that the rest cannot be determined. A fault outside the nine is named if it is likelier than the
        second condition.

    Examples
    --------
    >>> alike = {"normal": 0.314, "minor_friction": 0.314, "major_friction": 0.314, "minor_leakage": 0.0}
    >>> headline({"probabilities": alike, "unknown": False, "condition": "normal", "since_s": None})
    'normal leakage, probability 94.2 %; friction cannot be told: normal, minor or major friction equally likely'
    """
    (best, first), (second, other) = ranked_shares(result["probabilities"], unknown=result["unknown"])[:2]
    if result["unknown"]:
        nearest = f"{condition_in_words(best)} ({percent_text(first)} % if it had to be one of them)"
        alone = len(result.get("reasons", ())) == 1  # another reason may say that no condition fits
        still = alone and any(note["code"] == AgainstCode.STUCK_OR_LEAKS for note in result.get("notes", ()))
        words = STILL_WORDS if still else NEAREST_WORDS
        return f"{words}{nearest}, then {condition_in_words(second)} ({percent_text(other)} %)"
    if len(as_likely := equally_likely(result)) > 1:
        told = _shared_fault(as_likely, result["probabilities"])
        faulty = result["since_s"] is not None or not told[0].startswith(f"{LEVELS_IN_WORDS['none']} ")
        parts = [*told, onset_clause(result) if faulty else ""]
        return "; ".join(part for part in parts if part)
    outside = 1.0 - sum(result["probabilities"].values())
    runner_up, other = (
        (OUTSIDE_WORDS, outside) if outside > max(other, LEAST_REPORTED) else (condition_in_words(second), other)
    )
    parts = [
        f"{condition_in_words(best)}, probability {percent_text(first)} %",
        onset_clause(result),
        f"second most likely {runner_up}, {percent_text(other)} %",
    ]
    return "; ".join(part for part in parts if part)


def ranked_shares(probabilities: Mapping[str, float], *, unknown: bool) -> list[tuple[str, float]]:
    """Return conditions with their probabilities, the likeliest first.

    Parameters
    ----------
    probabilities : Mapping[str, float]
        Probability of each condition [probability].
    unknown : bool
        Whether none of them explains the log: then each share is the probability given that one of them is true.

    Returns
    -------
    list of tuple of str and float
        Name and share [probability].
    """
    whole = sum(probabilities.values()) if unknown else 1.0
    return sorted(((name, share / whole) for name, share in probabilities.items()), key=lambda item: -item[1])


def equally_likely(result: Mapping[str, Any]) -> list[str]:
    """Return the conditions that are as likely as the likeliest, which this log does not separate.

    Returns
    -------
    list[str]
        Conditions in the order of `CONDITIONS`; only the likeliest if the log separates it from the others.
    """
    from faults.conditions import CONDITIONS  # here, since estimates do not need it

    shares = result["probabilities"]
    least = EQUALLY_LIKELY_RATIO * max(shares.values())
    return [name for name in CONDITIONS if shares.get(name, 0.0) >= least]


def _shared_fault(conditions: Sequence[str], shares: Mapping[str, float]) -> list[str]:
    """Return the fault that equally likely conditions share, its probability, and the open part."""
    from faults.conditions import CONDITIONS  # here, since estimates do not need it

    levels = {axis: [getattr(CONDITIONS[one], axis) for one in conditions] for axis in ("leakage", "friction")}
    told = {axis: LEVELS_IN_WORDS[found[0]] for axis, found in levels.items() if len(set(found)) == 1}
    if not told:
        among = _joined_by_or([condition_in_words(one) for one in conditions])
        return [f"leakage and friction cannot be told: {among} equally likely"]
    ((axis, level),) = told.items()
    (other,) = set(levels) - {axis}
    among = _joined_by_or([LEVELS_IN_WORDS[one] for one in levels[other]])
    wanted = getattr(CONDITIONS[conditions[0]], axis)
    percent = percent_text(sum(share for one, share in shares.items() if getattr(CONDITIONS[one], axis) == wanted))
    return [f"{level} {axis}, probability {percent} %", f"{other} cannot be told: {among} {other} equally likely"]


def _joined_by_or(words: Sequence[str]) -> str:
    return " or ".join([*([", ".join(words[:-1])] if len(words) > 1 else []), words[-1]])


def onset_clause(result: Mapping[str, Any]) -> str:
    """Return since when the actuator has been in its condition.

    Returns
    -------
    str
        A clause; empty for an actuator that was healthy from the beginning.

    Examples
    --------
    >>> onset_clause({"condition": "minor_leakage", "since_s": None})
    'present since before the log began'
    """
    if result["since_s"] is not None:
        low, high = result["since_ci95_s"]
        before = condition_in_words(result["condition_before"])
        return f"since {result['since_s']:.2f} s ({low:.2f} to {high:.2f} s), {before} before"
    return "" if result["condition"] == "normal" else "present since before the log began"


def severities_text(result: Mapping[str, Any], names: Sequence[str]) -> str:
    """Return severities with their intervals.

    Returns
    -------
    str
        Text in workshop units.
    """
    return "; ".join(f"{SEVERITY_NAMES[name]} {severity_text(result['severity'][name])}" for name in names)


def severity_text(one: Mapping[str, Any]) -> str:
    """Return one severity with its interval.

    Parameters
    ----------
    one : Mapping
        ``value``, ``unit``, ``ci95`` and, if it is wider, ``ci95_total``.

    Examples
    --------
    >>> severity_text({"value": 2.07e8, "unit": "Pa", "ci95": [2.05e8, 2.09e8]})
    '207.0 MPa (205.0 to 209.0)'
    >>> severity_text({"value": 2.07e8, "unit": "Pa", "ci95": [2.05e8, 2.09e8], "ci95_total": [1.5e8, 2.8e8]})
    '207.0 MPa (205.0 to 209.0; with rig error 150 to 280)'
    >>> severity_text({"value": 28.578, "unit": "%", "ci95": [28.5776, 28.5784], "ci95_total": [24.0, 34.0]})
    '28.58 % (with rig error 24 to 34)'
    >>> severity_text({"value": -0.01, "unit": "N", "ci95": [-3.0, 4.0]})
    '0.0 N (-3.0 to 4.0)'
    >>> severity_text({"value": 1e-7, "unit": "%", "ci95": [0.0, 2e-7], "ci95_total": [0.0, 0.15]})
    'under 0.001 % (with rig error 0.00 to 0.15)'
    """
    if any(number is None or not math.isfinite(number) for number in (one["value"], *one["ci95"])):
        return "not determined"
    scale, unit = shop_unit(one["unit"])
    value, low, high = (scale * float(number) for number in (one["value"], *one["ci95"]))
    said, least = _interval(low, high), 10.0**-MOST_DECIMALS
    total = [scale * end for end in one.get("ci95_total", ()) if end is not None]
    wider = f"with rig error {_interval(*total)}" if len(total) == 2 and _interval(*total) != said else ""
    if max(map(abs, (value, low, high))) < 0.5 * least:
        beyond = f" ({wider})" if wider and max(map(abs, total)) >= 0.5 * least else ""
        return f"under {least:.{MOST_DECIMALS}f} {unit}{beyond}"
    shown = f"{value:z.{decimals_of(low, high, MOST_DECIMALS)}f}"
    narrow = said == f"{shown} to {shown}"  # so narrow that both ends show the same digits as the value
    return f"{shown} {unit} ({'; '.join(one for one in ('' if wider and narrow else said, wider) if one)})"


def _interval(low: float, high: float) -> str:
    decimals = decimals_of(low, high, MOST_DECIMALS)
    return f"{low:z.{decimals}f} to {high:z.{decimals}f}"


def reliability_text(result: Mapping[str, Any]) -> str:
    """Return whether the verdict may be trusted."""
    from experiments.eha.plain_verdict import causes

    if result["unknown"]:
        told = causes(result)
        more = len(result["reasons"]) - len(told)
        return f"no: {NEXT_LINE.join(told)}{f'; {more} more in --json, which may follow from this' if more else ''}"
    told = [
        "yes: a circuit in one of the nine conditions reproduces the log",
        *bulk_modulus_doubts(result),
        *result["not_told"],
    ]
    return NEXT_LINE.join(told)


def bulk_modulus_doubts(result: Mapping[str, Any]) -> list[str]:
    """Return why not to rely on a bulk modulus that is shown beside a class although its check failed."""
    gate, estimated = result["gate"], result["bulk_modulus_pa"]
    if result["unknown"] or gate is None or gate["passed"] or estimated is None or estimated["value"] is None:
        return []
    if result["severity"]["bulk_modulus"]["value"] != estimated["value"]:  # it is the circuit's, with its own interval
        return []
    return [f"do not rely on bulk modulus: {'; '.join(gate['reasons'])}"]


def next_step(result: Mapping[str, Any]) -> str:
    """Return what to do next, one sentence per line, the most important first."""
    from experiments.eha.plain_verdict import checks_on_actuator, is_of_another_size

    work, advice = checks_on_actuator(result), [sentence(one) for one in result["advice"]]
    return NEXT_LINE.join([*advice, *work] if is_of_another_size(result) else [*work, *advice])


def library_sentence(result: Mapping[str, Any]) -> str:
    """Return whether the library of transfer functions agrees with the verdict, which it never changes.

    Returns
    -------
    str
        One sentence; empty if no library was compared, if the log fits none of the nine conditions, or if the condition
        changed within the log, since one transfer function describes one condition.

    Examples
    --------
    >>> errors = {"normal": 0.0012, "minor_leakage": 0.0019}
    >>> found = {"condition": "normal", "unknown": False, "since_s": None, "transfer_function_scores": errors}
    >>> library_sentence(found)
    'The library of transfer functions agrees: normal has the smallest error in velocity, 1.20 mm/s; the next, minor \
leakage, has 1.90 mm/s.'
    """
    errors = result["transfer_function_scores"]
    if not errors or result["unknown"] is not False or result["since_s"] is not None:
        return ""
    ours = result["condition"]
    first, second = sorted(errors, key=errors.__getitem__)[:2]
    if not math.isfinite(errors[second]):
        return ""
    shown = {name: f"{1e3 * errors[name]:.2f} mm/s" for name in (first, second, ours)}
    if first == ours:
        return (
            f"The library of transfer functions agrees: {condition_in_words(first)} has the smallest error in "
            f"velocity, {shown[first]}; the next, {condition_in_words(second)}, has {shown[second]}."
        )
    return (
        f"The library of transfer functions names {condition_in_words(first)} instead: its error in velocity is "
        f"{shown[first]}, that of {condition_in_words(ours)} is {shown[ours]}. The verdict above does not use it."
    )


def margin_word(margin: float) -> str:
    """Return a word for how far the runner-up is behind.

    Parameters
    ----------
    margin : float
        Ratio of the runner-up's error to the best [dimensionless].

    Examples
    --------
    >>> margin_word(1.1)
    'narrow'
    """
    return next(word for bound, word in MARGINS if margin < bound or bound == math.inf)


def models_sentence(result: Mapping[str, Any]) -> str:
    """Return the verdict of the nine nominal models alone, in one sentence."""
    best, second, margin = result["condition"], result["runner_up"], result["margin"]
    if margin < MARGINS[0][0]:
        named = (
            f"{best}, but {margin_word(margin)}: the error of {second} is only {100.0 * (margin - 1.0):.1f} % larger"
        )
    elif not math.isfinite(margin):
        named = f"{best}, which fits exactly, as {second} does not"
    else:
        error = f"{100.0 * (margin - 1.0):.0f} % larger" if margin < 2.0 else f"{margin:.1f} times as large"
        named = f"{best}, by a {margin_word(margin)} margin: the error of {second} is {error}"
    return f"{NEAREST_WORDS}{named}" if result["unknown"] else named
