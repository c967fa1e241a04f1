"""`plain_fits(logged, start) -> PlainFits`: fits of the plain flow form, before any hypothesis is tested."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property, partial
from operator import attrgetter

from estimation.fits.flow.log import STIFFEST_OIL, flow_log
from estimation.fits.flow.mean_rows import NO_MEAN, PressureMean
from estimation.fits.flow.search import balance_fits, flow_starts, likeliest_swinging, refitted_balances
from estimation.fits.flow.swept import with_first_fit
from estimation.fits.flow.turns_read import with_turns_read
from estimation.fits.greybox.fit import GreyBoxFit
from estimation.fits.greybox.log import GreyBoxLog
from estimation.fits.greybox.play import ShownPlay, omitted_play_uncertainty
from estimation.fits.greybox.pump_ripple import Turning
from estimation.fits.hypothesis_search.between_samples import with_course
from estimation.fits.hypothesis_search.fit_objections import fit_explains, is_too_close, residual_limits
from estimation.fits.hypothesis_search.form_fit import LONGEST_STEP
from estimation.fits.hypothesis_search.pump_ripple_fits import with_pump_ripple
from estimation.fits.hypothesis_search.speed_offset import confirms_offset, offset_by_lost_flow
from estimation.models.flow import HELD_FLOW_FORM
from plant.eha.model import EhaParameters
from plant.log.record import Record
from plant.notes import Note

LEAST_GUESS = 1e-2
"""Smallest first guess of bulk modulus, over the rig file's [fraction]."""

MOST_EXCESS_NOISE = 2.0
"""Ratio of the noise variance assumed for a fit to that at the bulk modulus which explains the log, from which the log
is fitted again [dimensionless]. Below it, gates at 1.1 to 1.44 times the noise still detect a misfit, and sound logs
need no second search."""

VALVE_DROP = 5e4
"""Pressure drop at which a make-up valve of usual size passes the rated flow [Pa]; judged: check valves have 0.3 to 1
bar. Such a valve fills a chamber of the paper's actuator in 7 ms, and one of a small rig with stiff oil in 0.02 to 0.1
ms."""

_cost = attrgetter("cost")


@dataclass(frozen=True, eq=False)
class Logged:
    """A log without gross outliers, with its noise.

    Parameters
    ----------
    record : Record
        The channels.
    variances : Mapping[str, float]
        Measurement variance of each [SI squared].
    uncertainties : Mapping[str, float]
        Relative standard deviation of the actuator's parameters [fraction].
    mean : PressureMean
        Rows that each pressure is the mean of.
    """

    record: Record
    variances: Mapping[str, float]
    uncertainties: Mapping[str, float] = field(default_factory=dict[str, float])
    mean: PressureMean = NO_MEAN

    def as_flow_log(self, parameters: EhaParameters, *, held: bool = False) -> GreyBoxLog:
        """Return the log as the flow form sees it for an actuator, whose motor command may be ``held``."""
        return flow_log(self.record, parameters, self.uncertainties, self.variances, held=held, mean=self.mean)


@dataclass(frozen=True, eq=False)
class FitStart:
    """Where the searches of a fit begin.

    Parameters
    ----------
    parameters : EhaParameters
        The actuator.
    bulk_modulus : float
        First guess of effective bulk modulus [Pa].
    speed_offset : float
        First guess of how much the logged speed exceeds the shaft's [rad/s].
    valley : Mapping[str, float], optional
        Values of the plain form's unknowns at which searches begin as well, see `lower_minimum` [SI].
    stiffest : float
        Largest bulk modulus for which the effect of motor speed noise is computed, see `quieter_start` [Pa].
    turns_read : bool
        Whether the volume pumped in a slow log's turns is read from the samples after them, see `with_turns_read`.
    implicit : bool
        Whether model steps are implicit, see `with_implicit_steps`.
    held, turns_open : bool
        Whether the motor's command is held between samples, and whether the course of turns is free in a log that is
        not slow; see `estimation.fits.flow.motor_course`.
    """

    parameters: EhaParameters
    bulk_modulus: float
    speed_offset: float = 0.0
    valley: Mapping[str, float] | None = None
    stiffest: float = STIFFEST_OIL
    turns_read: bool = False
    implicit: bool = False
    held: bool = False
    turns_open: bool = False


@dataclass(frozen=True, eq=False)
class PlainFits:
    """The plain form's fits of a log.

    Parameters
    ----------
    start : FitStart
        Where the searches began.
    starts : sequence of Mapping[str, float]
        All starts of the searches [SI].
    fitted : callable
        ``fitted(log)``: the fits of a log by every form that counts.
    unturned, log : GreyBoxLog
        The log before and after correction for pump ripple and speed offset; the second with position noise at the bulk
        modulus found.
    fits : sequence of GreyBoxFit
        One fit by each form that counts.
    explains : callable
        ``explains(fit)``: whether a fit explains the log.
    teeth, teeth_left : tuple of Note
        Notes on the pump ripple and speed offset that were corrected, and on what residuals still show of them.
    turning : Turning
        The ripple and the offset that were corrected.
    """

    start: FitStart
    starts: Sequence[Mapping[str, float]]
    fitted: Callable[[GreyBoxLog], Sequence[GreyBoxFit]]
    unturned: GreyBoxLog
    log: GreyBoxLog
    fits: Sequence[GreyBoxFit]
    explains: Callable[[GreyBoxFit], bool]
    teeth: tuple[Note, ...]
    teeth_left: tuple[Note, ...]
    turning: Turning

    @cached_property
    def turns_readable(self) -> bool:
        """Whether the volume pumped in a slow log's turns can be read from the samples after them, and is not yet."""
        log = self.unturned
        return not self.start.turns_read and with_turns_read(log, self.start.parameters) is not log

    @property
    def best(self) -> GreyBoxFit:
        """The likeliest fit."""
        return min(self.fits, key=_cost)

    @property
    def swinging(self) -> GreyBoxFit:
        """The likeliest fit with varying chamber volumes."""
        return likeliest_swinging(self.fits)

    def yields(self, sensed: ShownPlay, bulk_modulus: float) -> float:
        """Return the compliance within the encoder's play, over that of the oil.

        Parameters
        ----------
        sensed : ShownPlay
            The play that a velocity sensor shows.
        bulk_modulus : float
            Of the oil [Pa].

        Returns
        -------
        float
            The ratio [fraction].
        """
        softness = self.start.parameters.piston_area * sensed.yields / self.start.parameters.chamber_volume
        return softness * bulk_modulus

    def play_untaken(self, shown: ShownPlay, sensed: ShownPlay) -> tuple[float, tuple[Note, ...]]:
        """Return the uncertainty due to a play that no fit includes, see `omitted_play_uncertainty`.

        Parameters
        ----------
        shown : ShownPlay
            The play that the residuals of the reported fit show.
        sensed : ShownPlay
            The play that a velocity sensor shows.

        Returns
        -------
        tuple of (float, tuple of Note)
            Relative deviation of bulk modulus [fraction], and a note if the gate does not reject the fit for it.
        """
        return omitted_play_uncertainty(shown, sensed, self.yields(sensed, self.swinging.values["bulk_modulus"]))


def plain_fits(logged: Logged, start: FitStart, near: Sequence[GreyBoxFit] = ()) -> PlainFits:
    """Fit the plain flow form to a log by every balance that counts.

    On the way, the motor's course between samples, the pump's flow ripple and an offset of speed are corrected.

    Parameters
    ----------
    start : FitStart
        Where searches begin.
    near : sequence of GreyBoxFit
        Fits of nearly the same log: searches start from them.
    """
    parameters = start.parameters
    log = logged.as_flow_log(parameters, held=start.held)
    if start.turns_read:
        log = with_turns_read(log, parameters)
    log = replace(log, stiff=start.implicit)
    starts = flow_starts(parameters, max(start.bulk_modulus, LEAST_GUESS * parameters.bulk_modulus))
    explains = partial(fit_explains, noisy=log.passes_on)
    largest, _ = residual_limits(log.passes_on, log.count_measured)
    fitted = partial(balance_fits, parameters=parameters, starts=starts, valley=start.valley, stiffest=start.stiffest)
    led = partial(refitted_balances, parameters=parameters, fits=near, stiffest=start.stiffest) if near else fitted
    unturned = with_course(log, led, parameters, always=start.turns_open)
    turned = partial(with_pump_ripple, unturned, led, explains, largest)
    found = turned(start.speed_offset)
    settled = start.implicit or not fills_within_a_step(parameters)
    if settled and not (explains(found.best) or start.speed_offset):
        offset = offset_by_lost_flow(unturned, parameters)
        other = turned(offset) if offset else found
        found = other if explains(other.best) and confirms_offset(other, largest, parameters) else found
    log, fits, teeth, left = found
    turning = Turning(log.teeth, log.speed_offset)
    values = likeliest_swinging(fits).values
    log = with_first_fit(log, parameters, values, start.stiffest)
    kept = [fit for fit in fits if fit.model.rates is not HELD_FLOW_FORM.rates or not is_too_close(fit, log.passes_on)]
    return PlainFits(start, starts, fitted, unturned, log, kept, explains, teeth, left, turning)


def fills_within_a_step(p: EhaParameters) -> bool:
    """Return whether make-up valves of a usual size fill a chamber within a model step."""
    return 2.0 * p.chamber_volume * VALVE_DROP < LONGEST_STEP * p.bulk_modulus * p.rated_flow


def with_stiff_oil(logged: Logged, plain: PlainFits) -> EhaParameters | None:
    """Return the actuator with the stiff oil that was found, if position noise starts to matter at that stiffness.

    Returns
    -------
    EhaParameters or None
        The actuator with which to fit the log again; None if position noise matters already, or nowhere.
    """
    parameters, swinging = plain.start.parameters, plain.swinging
    found = swinging.values["bulk_modulus"]
    if plain.log.passes_on or found <= parameters.bulk_modulus or not plain.explains(swinging):
        return None
    stiff = replace(parameters, bulk_modulus=found)
    return stiff if logged.as_flow_log(stiff).passes_on else None


def quieter_start(plain: PlainFits, strange: GreyBoxFit) -> FitStart | None:
    """Return the start of a second fit, if the noise was computed for far stiffer oil than the one that fits.

    The effect of motor speed noise on pressure grows with the oil's stiffness. If the plain form ends in a wrong
    minimum, as at 100 GPa, the assumed noise is so large that a false pressure offset of 4 bar explains the log, and a
    wrong bulk modulus seems certain to a thousandth.

    Parameters
    ----------
    plain : PlainFits
        The log's fits.
    strange : GreyBoxFit
        The fit that explains the log.

    Returns
    -------
    FitStart or None
        None if the noise is already that of the oil that explains the log, or does not matter.
    """
    modulus, log = strange.values["bulk_modulus"], plain.log
    heard = min(plain.swinging.values["bulk_modulus"], plain.start.stiffest)
    white, walked = log.noise[0].variance * log.sample_time / log.block, log.noise[0].walk * log.block
    quiet = white + walked * min(modulus / heard, 1.0) ** 2
    return replace(plain.start, stiffest=modulus) if white + walked > MOST_EXCESS_NOISE * quiet else None
