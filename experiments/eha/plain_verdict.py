"""A diagnosis for a mechanic: the verdict in one sentence, and what to do about it.

`result` always holds the entries of a diagnosis with probabilities.
"""

import math
from collections.abc import Mapping
from typing import Any

from estimation.log_checks.notes import LoggerCode
from estimation.notes import ChannelCode, EstimateCode, RigCode, SensorCode
from experiments.page.condition_names import condition_in_words, level_in_words
from experiments.page.sentences import joined_names, sentence, unused_column_advice
from faults.conditions import CONDITIONS
from faults.notes import AdviceCode, AgainstCode

SURE, LIKELY = 0.99, 0.8
"""Probabilities from which a verdict is called certain, and probable [probability]."""

MAJOR = 2.0
"""Size of a fault from which it is treated as major, where 1 is minor [dimensionless]."""

LEAST_DOUBT_UNSTATED = 0.5
"""A level of leakage or friction is not stated if all else has at least this probability [probability]."""

PROBABLE_BELOW = 0.9
"""Probability below which a stated level is called only probable [probability]; chosen by judgement."""

LEAKS: Mapping[str, str] = {
    "minor": "leaks inside more than it should (minor leakage)",
    "major": "leaks badly inside (major leakage)",
}
RUBS: Mapping[str, str] = {
    "minor": "has more friction than it should (minor friction)",
    "major": "has far too much friction (major friction)",
}

WHICH_LEAKS = (
    "The log shows how much leaks, not which of the two: shut the cylinder's ports under load; if the piston creeps, "
    "its seal leaks, else the pump."
)
WORK_ON_LEAKAGE: Mapping[str, str] = {
    "minor": f"Plan a check of pump and piston seal. {WHICH_LEAKS}",
    "major": f"Check pump and piston seal now. {WHICH_LEAKS}",
}
WORK_ON_FRICTION: Mapping[str, str] = {
    "minor": "Plan a check of seals, guides and alignment of the rod.",
    "major": "Check seals, guides and alignment of the rod now.",
}
"""Maintenance advice for each level."""

WRONG_SENSORS = frozenset(
    {SensorCode.SENSOR_FROZE, SensorCode.SENSOR_CONSTANT, SensorCode.SENSOR_NOISE_ONLY, SensorCode.SENSORS_DISAGREE}
)
"""Codes of sensors whose readings are unusable."""

HINDRANCES: Mapping[frozenset[str], str] = {
    frozenset(map(str, ChannelCode)): "the sign, unit or name of {} is wrong",
    frozenset(map(str, WRONG_SENSORS)): "the sensor of {} reads wrong",
    frozenset(map(str, LoggerCode)): "the logger left measurements of {} out",
}
"""What prevents a verdict, with the channel, by the codes of the notes; the first match is reported."""

WRONG_INPUT = WRONG_SENSORS.union(ChannelCode, LoggerCode)
"""Codes of wrong sensors and columns, which may cause the other reasons against a verdict."""

OUTSIDE_CODE = str(AgainstCode.OUTSIDE_CONDITIONS)
OTHER_SIZE_CODES = (OUTSIDE_CODE, str(AgainstCode.BETWEEN_CONDITIONS))
"""Codes of logs that a circuit explains, but with leakage and friction that match none of the nine conditions."""

OUTSIDE: Mapping[str, str] = {
    str(RigCode.LEAKAGE_GROWS): "Leakage grows while the actuator runs.",
    str(RigCode.PUMP_WORN): "The pump delivers less than it should: it is worn, or the rig file is wrong.",
    str(RigCode.MAKEUP_BLOCKED): "A make-up valve is stuck shut.",
    str(RigCode.PORT_DRAINS): "A make-up valve leaks or is stuck open.",
    str(RigCode.RELIEF_LOW): "The relief valve opens too early, or leaks.",
    str(RigCode.AIR_ENTERS): "Air gets into the oil.",
    str(RigCode.BORE_LEAKS): "The actuator leaks more at one place of its stroke: the bore may be scored.",
    str(RigCode.TOOTH_LEAKS): "The pump leaks once in each turn: one tooth may be worn.",
    str(RigCode.PUMP_STARVES): "The pump does not fill at high speed.",
    str(RigCode.LEAKAGE_LIFTS): "The actuator leaks more above some pressure: a seal lifts, or a valve opens.",
    str(AgainstCode.ROD_BLOCKED): "The piston does not move at a pressure that major friction cannot hold.",
    str(RigCode.LEAKS_ONE_WAY): "The actuator leaks more in one direction: a valve may leak.",
}
"""Faults that are none of the nine conditions, by the code of their note."""


def verdict(result: Mapping[str, Any]) -> str:
    """Return the verdict in one sentence.

    Examples
    --------
    >>> verdict({"condition": "normal", "unknown": False, "notes": []})
    'The actuator is healthy: leakage and friction are normal.'
    """
    if result["unknown"]:
        return " ".join(_named_fault(result)) or f"No verdict: {_hindrance(result)}."
    levels = _levels(result)
    faults = {"leakage": LEAKS.get(levels["leakage"] or ""), "friction": RUBS.get(levels["friction"] or "")}
    doubt = {
        name: "" if _share(result, name, level) >= PROBABLE_BELOW else "probably " for name, level in levels.items()
    }
    wrong = " and ".join(f"{doubt[name]}{one}" for name, one in faults.items() if one)
    others = [
        f"{name} is {doubt[name]}normal" if levels[name] else f"{name} cannot be told from this log"
        for name, one in faults.items()
        if not one
    ]
    soft = "; its oil is softer than its limit" if _soft_oil(result) else ""
    if wrong:
        return f"The actuator {'; '.join([wrong, *others])}{soft}."
    if None in levels.values():
        return sentence("; ".join(others) + soft.replace("its", "the", 1))
    if soft:
        return "The oil is softer than its limit; leakage and friction are normal."
    if any(doubt.values()):
        return f"The actuator is probably healthy: {' and '.join(others)}."
    return "The actuator is healthy: leakage and friction are normal."


def _hindrance(result: Mapping[str, Any]) -> str:
    """Return why there is no verdict, in one clause."""
    for accused, words in HINDRANCES.items():
        notes = [one for one in result["notes"] if one["code"] in accused and one["text"] in result["reasons"]]
        if notes:
            named = dict.fromkeys(one["data"].get("channel", "velocity_m_s or position_m") for one in notes)
            return words.format(joined_names(list(named)))
    codes = {one["code"] for one in result["notes"]}
    if AgainstCode.STUCK_OR_LEAKS in codes:
        return "the piston stands still, and without pressure the log does not tell why"
    if EstimateCode.PRESSURE_SMOOTHED in codes:
        return "the pressure was smoothed, so that no fit can be checked"
    if EstimateCode.RIG_CONTRADICTED in codes:
        return "the log and the rig file contradict each other"
    return "the log does not fit any known condition of this actuator"


def size_in_words(result: Mapping[str, Any]) -> str:
    """Return the size of a fault that lies between the nine conditions: 'leakage between none and minor'."""
    return "; ".join(level_in_words(name, size) for name, size in _fault_sizes(result).items())


def _levels(result: Mapping[str, Any]) -> dict[str, str | None]:
    """Return the levels of leakage and of friction; None if everything else together is likelier.

    Probability left over for faults outside the nine conditions, such as a worn pump, also counts as everything else.
    """
    best = CONDITIONS[result["condition"]]
    levels = {name: getattr(best, name) for name in ("leakage", "friction")}
    return {
        name: level if _share(result, name, level) > 1.0 - LEAST_DOUBT_UNSTATED else None
        for name, level in levels.items()
    }


def _share(result: Mapping[str, Any], name: str, level: str | None) -> float:
    """Return the probability of a level of leakage or of friction; 1 if a log has no probabilities."""
    shares = result.get("probabilities")
    if not shares:
        return 1.0
    return float(sum(share for one, share in shares.items() if getattr(CONDITIONS[one], name) == level))


def _soft_oil(result: Mapping[str, Any]) -> bool:
    return any(one["code"] == str(AdviceCode.BLEED) for one in result["notes"])


def _outside_faults(result: Mapping[str, Any]) -> list[str]:
    """Return the named faults that are none of the nine conditions."""
    return [OUTSIDE[one["code"]] for one in result["notes"] if one["code"] in OUTSIDE]


def is_other_fault(result: Mapping[str, Any]) -> bool:
    """Return whether the verdict names a fault that is none of the nine conditions."""
    return bool(result["unknown"] and _outside_faults(result))


def _named_fault(result: Mapping[str, Any]) -> list[str]:
    """Return the fault outside the nine conditions by name, or else as a size between theirs."""
    found = _outside_faults(result)
    words = {"leakage": "leaks more inside", "friction": "has more friction"}
    raised = [words[name] for name in _fault_sizes(result)] if not found else []
    if raised:
        found.append(f"The actuator {' and '.join(raised)} than a healthy one, or the rig file or a sensor is wrong.")
    return found


def _fault_sizes(result: Mapping[str, Any]) -> dict[str, float]:
    """Return the loss whose size is neither minor nor major: 1 is minor, 2 is major [dimensionless]."""
    sizes = [one["data"] for one in result["notes"] if one["code"] in OTHER_SIZE_CODES]
    return {name: data[name] for data in sizes for name in ("leakage", "friction") if data[name] > 0.0}


def is_doubted(result: Mapping[str, Any]) -> bool:
    """Return whether no number of a diagnosis can be relied on, because its model does not fit the log."""
    return bool(result["unknown"]) and not is_of_another_size(result)


def is_of_another_size(result: Mapping[str, Any]) -> bool:
    """Return whether a circuit fits the log and only the size of its faults differs from the nine conditions."""
    return (
        result["unknown"] and len(result["reasons"]) == 1 and not _outside_faults(result) and bool(_fault_sizes(result))
    )


def confidence_cost_onset(result: Mapping[str, Any]) -> str:
    """Return the confidence of the verdict, the cost of the fault, and its onset."""
    if result["unknown"]:
        told = causes(result)
        reasons = f": {told[0]}." if len(told) == 1 else ":" if told else "."
        if is_of_another_size(result) and any(one["code"] == OUTSIDE_CODE for one in result["notes"]):
            return sentence(causes(result)[0])
        if is_of_another_size(result):
            sizes = " and ".join(f"{name} {size:g}" for name, size in _fault_sizes(result).items())
            return (
                "The size is none of those of the nine conditions: to the nearest quarter, it is "
                f"{sizes}, where 1 is minor and 2 is major."
            )
        if _named_fault(result):
            return f"This is none of the nine conditions, so do not rely on the numbers below{reasons}"
        return f"Do not rely on anything on this page{reasons}"
    return " ".join(one for one in (confidence_sentence(result), _cost(result), _onset(result)) if one)


def separate_reasons(result: Mapping[str, Any]) -> list[str]:
    """Return the reasons against a verdict as sentences if there are several.

    A single reason is in `confidence_cost_onset`.
    """
    told = causes(result) if is_doubted(result) else []
    return [sentence(one) for one in told] if len(told) > 1 else []


def causes(result: Mapping[str, Any]) -> list[str]:
    """Return the reasons against a verdict, without those that a wrong sensor or column may cause."""
    first = [one["text"] for one in result["notes"] if one["code"] in WRONG_INPUT and one["text"] in result["reasons"]]
    return first or list(result["reasons"])


def confidence_sentence(result: Mapping[str, Any]) -> str:
    """Return the confidence of the verdict, in one sentence.

    Examples
    --------
    >>> shares = {"normal": 0.9, "minor_leakage": 0.1}
    >>> confidence_sentence({"condition": "normal", "notes": [], "probabilities": shares})
    'This is probable (90 %).'
    """
    told = {name: level for name, level in _levels(result).items() if level is not None}
    share = sum(
        one
        for name, one in result["probabilities"].items()
        if all(getattr(CONDITIONS[name], axis) == level for axis, level in told.items())
    )
    if not told:
        return "The log leaves several conditions possible."
    what = f"The verdict on {' and '.join(told)}" if _soft_oil(result) or len(told) == 1 else "This"
    if share >= SURE:
        return f"{what} is certain (over {100.0 * SURE:.0f} %)."
    word = "probable" if share >= LIKELY else "the most likely of several explanations"
    return f"{what} is {word} ({100.0 * share:.0f} %)."


def _cost(result: Mapping[str, Any]) -> str:
    lost = result["severity"].get("velocity_lost", {"value": None})["value"]
    if result["condition"] == "normal" or lost is None or not math.isfinite(lost) or lost < 1.0:
        return ""
    return f"The actuator is {lost:.0f} % slower than a healthy one at rated speed."


def _onset(result: Mapping[str, Any]) -> str:
    if result["since_s"] is not None:
        low, high = result["since_ci95_s"]
        before = condition_in_words(result["condition_before"])
        since = f"{result['since_s']:.2f} s into the log ({low:.2f} to {high:.2f} s)"
        return f"The condition changed {since}; until then it was {before}."
    named = set(_levels(result).values()) & {*LEAKS, *RUBS}
    return "" if not named else "The fault was there before the log began."


def what_to_do(result: Mapping[str, Any]) -> list[str]:
    """Return what to do, the most important first.

    Returns
    -------
    list[str]
        Work on the actuator first, then how to read this log, then how to log next; if a sensor with a wrong gain would
        give the same result, work on the actuator last.
    """
    advice = [sentence(one) for one in result["advice"]]
    if is_of_another_size(result):  # a wrong sensor or rig file would look the same, so check for it first
        return [*unused_column_advice(result), *advice, *checks_on_actuator(result)]
    return [*checks_on_actuator(result), *unused_column_advice(result), *advice]


def checks_on_actuator(result: Mapping[str, Any]) -> list[str]:
    """Return what to check on the actuator itself, as sentences.

    Returns
    -------
    list[str]
        Empty if the verdict is unknown or leaves leakage or friction open, or if only the oil is soft.
    """
    if is_of_another_size(result):
        works = {"leakage": WORK_ON_LEAKAGE, "friction": WORK_ON_FRICTION}
        work = [works[name]["minor" if size < MAJOR else "major"] for name, size in _fault_sizes(result).items()]
        return [f"If rig file and sensors are right: {one[:1].lower()}{one[1:]}" for one in work]
    if result["unknown"]:
        return []
    levels = _levels(result)
    work = WORK_ON_LEAKAGE.get(levels["leakage"] or ""), WORK_ON_FRICTION.get(levels["friction"] or "")
    sound = not _soft_oil(result) and None not in levels.values()
    return [one for one in work if one] or (["Nothing needs repair."] if sound else [])
