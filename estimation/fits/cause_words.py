"""What each hypothesis about a log is called in a sentence."""

from collections.abc import Sequence

CAUSE_WORDS = {
    "air": "air in the oil",
    "air_midway": "air that enters the oil during the log",
    "checks_crack": "make-up valves that open late",
    "delivery": "a pump that delivers less than its displacement",
    "encoder_zero": "a position sensor with its zero away from mid-stroke",
    "leakage_growth": "leakage that grows",
    "leakage_rise": "leakage that grows",
    "leakage_step": "a sudden leak",
    "leakage_turbulent": "turbulent leakage",
    "makeup_bends": "make-up valves that act as orifices",
    "makeup_blocked": "a make-up valve that is stuck shut",
    "port_a_drains": "a leaking make-up valve of chamber A",
    "port_b_drains": "a leaking make-up valve of chamber B",
    "position_late": "a position that was logged late",
    "position_play": "play of the position sensor",
    "pressure_drift": "a pressure sensor whose offset drifts",
    "pressure_late": "a pressure that was logged late",
    "pressure_offset": "an offset of the pressure sensor",
    "pressure_sides": "two pressure gauges with different gains",
    "pump_compresses": "a pump that compresses its oil before it delivers it",
    "relief_low": "a relief valve that opens early",
    "single_rod": "a piston with two different areas",
    "speed_early": "a motor speed that is ahead of the other channels",
    "speed_late": "a motor speed that was logged late",
    "start_load": "a load at the start of the log",
    "volume": "another chamber volume",
}
"""Words for each `estimation.fits.hypotheses.Hypothesis`, by its name: the subject of a sentence."""


def causes_in_words(names: Sequence[str]) -> str:
    """Return hypotheses as words of a sentence.

    Parameters
    ----------
    names : sequence of str
        Names of hypotheses.

    Examples
    --------
    >>> causes_in_words(["air", "pressure_late"])
    'air in the oil and a pressure that was logged late'
    """
    return " and ".join(CAUSE_WORDS[name] for name in names)
