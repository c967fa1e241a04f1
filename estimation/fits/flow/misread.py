"""`CorrectedLogs(logged, rig).misread(plain, found)`: a slip of sign or unit without which a log matches the rig.

Correlations between channels reveal such a slip in most logs (`estimation.log_checks.channel_physics`). A short log, or
one whose piston hardly moves, has too little information for that. The flow form may even explain it, with oil a tenth
as stiff and a pump that loses more than it delivers. If a fit ends there, slips are corrected one at a time and the log
is fitted again.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from math import log as ln
from operator import itemgetter

import numpy as np

from estimation.fits.flow.guesses import guesses_about
from estimation.fits.flow.plain import FitStart, Logged, PlainFits, plain_fits
from estimation.fits.flow.rough_search import GUESSED_WITHIN, ROUGH_ENOUGH
from estimation.fits.flow.search import flow_starts
from estimation.fits.flow.slips import PAIRS, SLIPS, Slip, with_slips_corrected
from estimation.fits.greybox.descent import descend
from estimation.fits.greybox.fit import GreyBoxFit
from estimation.fits.greybox.freed_problem import FreedProblem
from estimation.fits.greybox.side_by_side import LANES
from estimation.fits.hypotheses import CHECKS_CRACK, MAKEUP_BENDS, OFFSET, PRESSURE_DRIFT
from estimation.fits.hypothesis_search.explain import REQUIRED_GAIN, Explanation
from estimation.fits.hypothesis_search.wide_problem import flow_bounds
from estimation.log_checks.channel_names import POSITION, PRESSURE, SPEED
from estimation.log_checks.flow_balance import MOST_LOST
from estimation.log_checks.sliding_pressure import sliding_excess, sliding_pressure
from estimation.log_checks.standstill import travels
from estimation.models.flow import FLOW_FORM, form_with_relief, reaches_relief
from estimation.notes import ChannelCode
from plant.eha.model import EhaParameters
from plant.notes import Note

Slips = tuple[Slip, ...]

FOREIGN, KIN = 7.0, 3.0
"""Ratio of bulk modulus to the rig file's, or its inverse, from which a slip is looked for, and up to which a corrected
log has oil like the rig's [dimensionless]; judged. Air may reduce an oil's stiffness to a fifth; rpm read as rad/s
gives a tenth."""

SURE_DEVIATIONS = 2.0
"""Deviations by which a fit that explains a log must be beyond what the rig allows [dimensionless]."""

ASKED_SECONDS = 2.0
"""Time after the pump first turns on which slips are tried first [s]: it rules out most of them."""

TURNING = 0.1
"""Share of the highest speed from which the pump turns [fraction]: far above a resolver's noise at rest."""

ALIKE = 0.1
"""Share by which the block counts of two fits may differ if their costs are compared [fraction]."""

LEAST_CHANGE = 4.0
"""Variance of a channel over that of its noise from which the channel counts as changing [dimensionless]; judged. A
dead sensor shows its noise alone, and any slower pump would explain that."""

UNLIKE_SLIPS = frozenset({OFFSET.name, PRESSURE_DRIFT.name, CHECKS_CRACK.name, MAKEUP_BENDS.name})
"""Hypotheses that no slip looks like: they add to a pressure or concern valves, and change neither scale nor sign."""

HOPEFUL, MOST_FITTED = 10.0, 4
"""Rough misfit up to which a corrected slip may explain a log, as a mean squared normalised residual [dimensionless],
and how many slips are fitted at most [count]; judged. The rough misfit of right slips is 1.0 to 1.2, of wrong ones 2 to
3,000."""

EQUAL_MISFITS = 1.2
"""Ratio of rough misfits up to which slips count as equally good [dimensionless]: right slips have that misfit at most.
Of these, the first to be fitted is that whose pressure is nearest to what the rig's friction takes."""

HOPELESS = 300.0
"""Rough misfit of the likeliest guess from which no search is made [dimensionless]: of right slips it is 2 to 120."""

EVALUATIONS = 40
"""Evaluations of the model for the rough misfit of a slip [count]."""


@dataclass(frozen=True, eq=False)
class CorrectedLogs:
    """A log with one slip corrected at a time, each fitted when needed.

    Parameters
    ----------
    logged : Logged
        The log.
    rig : EhaParameters
        The actuator, as its file has it.
    """

    logged: Logged
    rig: EhaParameters

    def misread(self, plain: PlainFits, found: GreyBoxFit, *, paired: bool = True) -> Note | None:
        """Return the slips that make a log match the rig, if a fit says that it does not match as it was read.

        Parameters
        ----------
        plain : PlainFits
            The log's fits by the plain form.
        found : GreyBoxFit
            The fit that is believed most.
        paired : bool
            Whether pairs of slips are tried if none alone explains the log.

        Returns
        -------
        Note or None
            None if the fit says that the log may be one of the rig's, if no slip explains it, or if pressure does not
            change.
        """
        if (plain.explains(found) and self.is_kin(plain, found)) or not _shows_change(self.logged, PRESSURE):
            return None
        slips = _likeliest_slips(self._single_slips, found) or (
            _likeliest_slips(self._double_slips, found) if paired else []
        )
        return _misread_note(slips) if slips else None

    def is_kin(self, plain: PlainFits, found: GreyBoxFit) -> bool:
        """Return whether a fit says that the log, as it was read, may be one of the rig's.

        Parameters
        ----------
        plain : PlainFits
            The log's fits by the plain form.
        """
        stiffer = found.values["bulk_modulus"] > self.rig.bulk_modulus
        # whether friction and oil agree that pressure is off
        alike = self._sliding_excess > 0.0 if stiffer else self._sliding_excess < 0.0
        times = KIN if alike else FOREIGN
        return _is_kin(found, self.rig, times, SURE_DEVIATIONS if plain.explains(found) else 0.0)

    def is_sound(self, plain: PlainFits, strange: Explanation) -> bool:
        """Return whether an effect makes the log match the rig and cannot be mistaken for a slip.

        Parameters
        ----------
        plain : PlainFits
            The log's fits by the plain form.
        strange : Explanation
            The effect.
        """
        return UNLIKE_SLIPS.issuperset(strange.names) and self.is_kin(plain, strange.fit)

    @cached_property
    def _sliding_excess(self) -> float:
        """How far the pressure as read exceeds that at which pistons slide, see `sliding_excess`; 0 for one at rest."""
        still = _is_still(self.logged, self.rig)
        return 0.0 if still else sliding_excess(sliding_pressure(self.logged.record, self.rig))

    @cached_property
    def _single_slips(self) -> Sequence[tuple[Slips, GreyBoxFit]]:
        return self._explaining_slips([(slip,) for slip in SLIPS])

    @cached_property
    def _double_slips(self) -> Sequence[tuple[Slips, GreyBoxFit]]:
        return self._explaining_slips(PAIRS)

    def _explaining_slips(self, tried: Sequence[Slips]) -> Sequence[tuple[Slips, GreyBoxFit]]:
        """Return the slips whose correction makes the log match the rig, each with its fit."""
        begun, rig = _beginning(self.logged), self.rig
        hopeful = _hopeful_slips(tried, begun, rig)
        fits = [(slips, one) for slips in hopeful if (one := _fit_if_corrected(slips, begun, rig)) is not None]
        if begun is self.logged:
            return fits
        return [(slips, one) for slips, _ in fits if (one := _fit_if_corrected(slips, self.logged, rig)) is not None]


def _likeliest_slips(explained: Sequence[tuple[Slips, GreyBoxFit]], found: GreyBoxFit) -> Sequence[Slips]:
    """Return the slips that explain a log no worse than its fit as read, and no worse than each other."""
    fits = [found, *(one for _, one in explained)]
    return [slips for slips, one in explained if all(_likelihood_lost(other, one) < REQUIRED_GAIN for other in fits)]


def _hopeful_slips(tried: Sequence[Slips], logged: Logged, rig: EhaParameters) -> Sequence[Slips]:
    """Return the slips whose correction may explain a log, by the misfit of a rough search for each.

    Noise alone does not reveal a unit of position, and a piston that then stands still reveals none at all.
    """
    left: list[tuple[tuple[float, float], Slips]] = []
    changes, as_read = _shows_change(logged, POSITION), _sliding_distances(logged, rig)
    for slips in tried:
        if any(slip.channel == POSITION and not _shows_change(logged, slip.other or POSITION) for slip in slips):
            continue
        right = _corrected_log(slips, logged, rig, as_read)
        if right is not None and any(slip.factor > 0.0 for slip in slips) and (not changes or _is_still(right, rig)):
            continue
        misfit = np.inf if right is None else _rough_misfit(right, rig)
        if right is not None and 0.0 < misfit < HOPEFUL:
            left.append(((max(misfit, 1.0 / misfit, EQUAL_MISFITS), _sliding_distances(right, rig)[1]), slips))
    return [slips for _, slips in sorted(left, key=itemgetter(0))[:MOST_FITTED]]


def _rough_misfit(logged: Logged, rig: EhaParameters) -> float:
    """Return the misfit of the balance by volume from the likeliest guess on, with long model steps [dimensionless].

    It is infinite if that guess is already hopeless, or if the search ends at oil unlike the rig's.
    """
    log = logged.as_flow_log(rig).with_noise_at(rig.bulk_modulus)
    form = form_with_relief(FLOW_FORM) if reaches_relief(log.measured, rig.relief_pressure) else FLOW_FORM
    problem = FreedProblem.of(form, log.coarsened())
    guesses = guesses_about(flow_starts(rig, rig.bulk_modulus)[0], form, rig)
    costs = problem.costs(guesses, LANES)
    if 2.0 * np.min(costs) > HOPELESS * problem.blocks:
        return np.inf
    bounds = flow_bounds(form, guesses, log)
    found = descend(problem.at, guesses[int(np.argmin(costs))], EVALUATIONS, bounds, ROUGH_ENOUGH, GUESSED_WITHIN)
    modulus = form.values(found.theta)["bulk_modulus"]
    return 2.0 * found.cost / problem.blocks if 1.0 / FOREIGN < modulus / rig.bulk_modulus < FOREIGN else np.inf


def _misread_note(found: Sequence[Slips]) -> Note:
    channels = dict.fromkeys(" and ".join(slip.channel for slip in slips) for slips in found)
    said = " or ".join(" and ".join(slip.said for slip in slips) for slips in found)
    return ChannelCode.CHANNEL_MISREAD.note(channel=" or ".join(channels), slip=said)


def _likelihood_lost(found: GreyBoxFit, other: GreyBoxFit) -> float:
    """Return by how much a fit is likelier than another [log-likelihood]; 0 if their blocks differ."""
    lost = 0.5 * found.seen * (other.chi_square[0] - found.chi_square[0])
    return lost if abs(other.seen - found.seen) < ALIKE * found.seen else 0.0


def _is_kin(fit: GreyBoxFit, rig: EhaParameters, times: float, surely: float) -> bool:
    """Return whether a fit's oil may be the rig's, and its pump loses no more than a leaky one does.

    A flow bias is at most a quarter of the rated flow. If a leak took the whole flow before the piston slides, the
    actuator would not move; a piston without friction at rest slides at once, whatever leaks.
    """
    slides = rig.friction_coulomb / rig.piston_area
    most_leaking = rig.rated_flow / slides if slides > 0.0 else np.inf
    most = {"flow_bias": MOST_LOST * rig.rated_flow, "leakage_coefficient": most_leaking}
    if any(fit.values.get(name, 0.0) - surely * fit.std.get(name, 0.0) > largest for name, largest in most.items()):
        return False
    modulus = fit.values["bulk_modulus"]
    if modulus <= 0.0:
        return False
    std = min(fit.std["bulk_modulus"] / modulus, 1.0)  # at most 1: an undetermined modulus must not match every rig
    return abs(ln(modulus / rig.bulk_modulus)) - surely * std < ln(times)


def _is_still(logged: Logged, rig: EhaParameters) -> bool:
    gone = travels(logged.record, rig)
    return gone is not None and gone.still


def _shows_change(logged: Logged, channel: str) -> bool:
    """Return whether a channel exists and shows more than its noise."""
    there = channel in logged.record and channel in logged.variances
    return there and bool(np.nanvar(logged.record[channel]) > LEAST_CHANGE * logged.variances[channel])


def _beginning(logged: Logged) -> Logged:
    """Return a log up to where its pump has turned for some time; all of it if it is shorter."""
    record = logged.record
    speed = np.abs(record[SPEED])
    told = np.all([np.isfinite(record[name]) for name in (SPEED, POSITION, PRESSURE)], axis=0)
    turning = np.flatnonzero(told & (speed > TURNING * np.nanmax(speed)))
    if not len(turning):
        return logged
    samples = int(turning[0]) + round(ASKED_SECONDS / record.sample_time) + 1
    return logged if samples >= len(record) else replace(logged, record=record.slice(0, samples))


def _corrected_log(slips: Slips, logged: Logged, rig: EhaParameters, as_read: tuple[float, float]) -> Logged | None:
    """Return a log with slips corrected; None if it lacks such channels, or its pressure then moves no piston.

    Its pressure must be no further from what the rig's friction takes than as read (`_sliding_distances`).
    """
    right = with_slips_corrected(slips, logged)
    return right if right is not None and _sliding_distances(right, rig) <= as_read else None


def _fit_if_corrected(slips: Slips, logged: Logged, rig: EhaParameters) -> GreyBoxFit | None:
    """Return the fit of a log with slips corrected, if it explains the log as one of the rig's."""
    right = _corrected_log(slips, logged, rig, _sliding_distances(logged, rig))
    if right is None:
        return None
    plain = plain_fits(right, FitStart(rig, rig.bulk_modulus))
    return plain.best if plain.explains(plain.best) and _is_kin(plain.best, rig, KIN, 0.0) else None


def _sliding_distances(logged: Logged, rig: EhaParameters) -> tuple[float, float]:
    """Return how far pressure is from that at which pistons slide, and from the rig's friction [logarithms]."""
    ratio = sliding_pressure(logged.record, rig)
    return abs(sliding_excess(ratio)), abs(ln(ratio)) if ratio > 0.0 else np.inf
