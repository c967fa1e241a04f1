"""The errata in one line each, for reports; told in full, with reasons, in ``docs/errata.md``."""

import re
from collections.abc import Mapping
from types import MappingProxyType

from markupsafe import Markup, escape

ERRATA: Mapping[str, str] = MappingProxyType(
    {
        "E1": "Pump displacement is read as m³/rad; Table 2 prints the unit of a flow.",
        "E2": "Bulk modulus is in the convention of the paper's equations, V₀/β; one sentence there halves it.",
        "E3": "The friction term of equation 7.3 is divided by M alone; V₀ cancels.",
        "E4": "Jacobians are differentiated from the models, not copied from 7.5, which gives one element twice.",
        "E5": "Leakage coefficients are read as m³/(s Pa); Table 3 prints another unit.",
        "E6": "Throttle voltages differ between text and Table 1; they enter no model.",
        "E7": "Tables 3 and 4 contradict the percentages by which section 3 defines the levels; tables are followed.",
        "E8": "A loss cannot exceed the flow: the flow bias makes a dead zone and never pumps backward.",
        "E9": "The published filter differentiates friction through its jump at rest, so a reversal misleads it.",
        "E10": "The published noise lets bulk modulus hardly move; the first guess gets a wide deviation instead.",
        "E11": "The published noise levels are too large for these signals; ours come from the sensors.",
        "E12": "The linear friction of minor friction is negative as printed, and kept.",
        "E13": "On the 10 Hz sine most of the flow goes into loading the oil and a real piston soon sticks; "
        "without pressure, the log then holds nothing about bulk modulus.",
        "E14": "Table 6 gives no sample time and no input unit, both are inferred; rounding hardly fixes some gains.",
        "E15": "Eight models in Table 6 jump at once, which a mass cannot do; filtering the output alone does that.",
        "E16": "Two sections are numbered 6, and Table 4's caption says leakage; read as sense demands.",
        "E17": "The outlet's case leakage in 5.2 belongs to the other port.",
        "E18": "The sentence after 5.4 sets P₂ equal to itself; P₂ = P_b is meant.",
        "E19": "Equations 5.13 and 5.14 lack a dot and a sign, which are restored.",
        "E20": "The paper's 2.07e8 Pa is the truth of these simulations; its earlier 2.1e8 Pa stands beside it.",
        "P1": "The hysteresis law is multiplied out; it has no jump and shares no letter with the chamber's height.",
        "P2": "Equation 2's product is a first-order lag, and hysteresis takes from the stroke.",
        "P3": "A run starts where the bias pressure holds the stack.",
        "P4": "The air fraction holds at atmospheric pressure.",
        "P5": "Equation 5 needs absolute pressure and a floor; liquid, air and vapour share one closed form.",
        "P6": "Signs in equations 8 and 11 are mended; ports and leakage are added to the chamber.",
        "P7": "Equation 13 lets a reed swing through its seat; it has a seat and a stop here.",
        "P8": "A reed's flow is laminar at small drops.",
        "P9": "The Reynolds number is checked, not assumed.",
        "P10": "Equation 17 lacks the volume between reed and line.",
        "P11": "The cylinder's low side and the way back are added.",
        "P12": "Minor losses follow the flow's direction; their sum is calibrated.",
        "P13": "Friction opposes motion, and the rod has end stops.",
        "P14": "Equations 29 to 33 cannot tell k_u from alpha; all parameters are fitted together.",
        "P15": "The flow curves are Figure 11, though the text says Figure 9.",
        "P16": "The accumulator's gas is part of the plant, unless it is shut.",
        "P17": "Table 1 and the figures are lost; parameters are calibrated to the numbers that the text quotes.",
        "M1": "The spring between diaphragm and cylinder restores; printed, the model is unstable.",
        "M2": "Springs and damping restore and damp; k₄ is a cubic spring.",
        "M3": "Signs follow equation 1; the diaphragm's mass may be left out.",
        "M4": "The natural frequency follows from the mended equations 1 to 3.",
        "M5": "Equation 5 is a free motion, not a damping; a Caputo derivative stands in its place.",
        "M6": "Equation 6 is the fractional derivative of t², a test and no part of the plant.",
        "M7": "Equation 7 is a textbook example and left out.",
        "M8": "Permittivity is at constant stress.",
        "M9": "Two indices, with engineering shear strains.",
        "M10": "Transposition and constant stress are told apart.",
        "M11": "The field has three components.",
        "M12": "The stress has six components.",
        "M13": "The matrices are those of the mended equations.",
        "M14": "Table 2 does not obey equation 14, whichever thickness is meant.",
        "M15": "h₃₁ is a calibration in V/m here; in Table 2 each row has its own.",
        "M16": "Voltage and pressure bend the diaphragm together.",
        "M17": "√5 is of a pump with five chambers; Table 2 was made with it.",
        "M18": "Table 2 obeys equation 18 but for two misprints.",
        "M19": "The load counts twice; the drive voltage is needed beside the sensing voltage.",
        "M20": "du is d times u.",
        "M21": "The law depends on rates of u alone, and so not on frequency.",
        "M22": "Table 1 holds sizes and materials only; the other parameters are derived, calibrated or assumed.",
        "M23": "Table 2's headings have wrong units and no driving voltage; row 1's diameter comes from its area.",
        "M24": "Figure 12 needs two numbers of Table 2 read otherwise; its regression is circular.",
        "M25": "The optimal frequencies of abstract and conclusion pair rows that do not belong together.",
        "M26": "Velocities and voltages of 7.2 and 7.3 are entries of Table 5; 168 mm/s does not belong to 110 mL/min.",
        "M27": "Volts are peak to peak; drives that would depole the ceramic are refused.",
        "M28": "Seven diaphragms, eight valves, seven electrodes.",
        "M29": "Table 4's errors are divided by the flow meter; it is another machine.",
        "M30": "Poles alone decide on stability.",
        "M31": "The best frequency does not rise with load, nor does the first electrode's voltage with frequency.",
    }
)
"""One sentence an erratum, by number."""

_NUMBER = re.compile(r"\b([EPM]\d{1,2})\b")
_LINK = re.compile(r'href="#([EPM]\d{1,2})"')


def linked(text: str) -> Markup:
    """Return a text with its errata numbers linked to the report's list.

    Parameters
    ----------
    text : str
        Plain text.

    Returns
    -------
    Markup
        The same, escaped, each number of `ERRATA` a link.

    Examples
    --------
    >>> linked("sticks (errata E9) & stays")
    Markup('sticks (errata <a href="#E9">E9</a>) &amp; stays')
    """

    def link(found: re.Match[str]) -> str:
        number = found[1]
        return f'<a href="#{number}">{number}</a>' if number in ERRATA else number

    return Markup(_NUMBER.sub(link, str(escape(text))))  # noqa: S704 - escaped just before


def linked_errata(html: str) -> Mapping[str, str]:
    """Return the errata that a page links to, in order of number.

    Parameters
    ----------
    html : str
        A page with links made by `linked`.

    Returns
    -------
    Mapping[str, str]
        The one-line text by number.
    """
    found = set(_LINK.findall(html))
    return {number: text for number, text in ERRATA.items() if number in found}
