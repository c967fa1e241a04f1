"""`fit_flow(record, parameters, ...) -> FormFit`: bulk modulus, leakage and flow bias of a log, by the flow form."""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from estimation.fits.flow.accumulator import gas_contradicted
from estimation.fits.flow.agreement import LogAnswer, agreed_answer, wanted_gain
from estimation.fits.flow.asked_hypotheses import (
    ALWAYS_ASKED,
    LONGEST_TESTED,
    UNPAIRED,
    hypotheses_asked,
    hypotheses_tested_alone,
    is_astray,
    near_starts,
)
from estimation.fits.flow.belief import explanation_test, hopeless_cost, judged, likelier_of, wanted_cost_in
from estimation.fits.flow.log import homed_at_stop, require_flow_channels, without_strays
from estimation.fits.flow.log_traits import AT_REST, LogTraits
from estimation.fits.flow.losses import UNEVEN_OIL, with_lumped, with_lumped_slopes
from estimation.fits.flow.mean_place import first_explained, placed_means
from estimation.fits.flow.misread import UNLIKE_SLIPS, CorrectedLogs
from estimation.fits.flow.model_steps import with_implicit_steps
from estimation.fits.flow.motor_course import with_motor_course, with_open_turns
from estimation.fits.flow.offset_beside import settled_offset
from estimation.fits.flow.other_minimum import lower_minimum
from estimation.fits.flow.plain import FitStart, Logged, PlainFits, plain_fits, quieter_start, with_stiff_oil
from estimation.fits.flow.search import MAKEUP_TRIED
from estimation.fits.flow.shut_valves import shut_valves
from estimation.fits.flow.swapped_sides import swapped_sides
from estimation.fits.flow.told_volume import explained_bound, ratio_doubt, unlikely_volume_doubt
from estimation.fits.greybox.lateness import omitted_delay_doubt
from estimation.fits.greybox.play import NO_PLAY, ShownPlay, omitted_play_note, play_structure, sensed_play
from estimation.fits.greybox.small_pump_ripple import with_shifts
from estimation.fits.greybox.work_limit import Work, WorkSpentError
from estimation.fits.hypotheses import (
    AIR,
    AIR_MIDWAY,
    BEGUN_UNDER_LOAD,
    HYPOTHESES,
    MAKEUP_BLOCKED,
    PLAY,
    PRESSURE_LATE,
    ZERO_HIDDEN,
    Hypothesis,
)
from estimation.fits.hypothesis_search.explain import REQUIRED_GAIN, explain
from estimation.fits.hypothesis_search.explanation import Explanation
from estimation.fits.hypothesis_search.fit_objections import objections_and_play, residual_limits
from estimation.fits.hypothesis_search.form_fit import DISCRETISED, FormFit, model_mean, weights_of, with_structure
from estimation.fits.hypothesis_search.not_excluded import open_wear_note, share_lost, unseen_valve_note
from estimation.fits.hypothesis_search.pump_delivery import delivery_objection
from estimation.fits.hypothesis_search.pump_ripple_fits import with_ripple_test
from estimation.fits.hypothesis_search.speed_offset import speed_offset_instead
from estimation.fits.hypothesis_search.varying_loss import VaryingLoss, loss_notes, varying_loss
from estimation.models.completed_flow import CRACKS, balances_mass
from estimation.models.flow import HELD_FLOW_FORM
from estimation.models.flow_parameters import is_single
from estimation.notes import EstimateCode
from plant.eha.model import EhaParameters
from plant.log.record import Record
from plant.notes import Note

REPORTED = ("leakage_coefficient", "flow_bias")
"""Parameters reported along with bulk modulus."""

STRUCTURE = 2e-4
"""Relative standard deviation of bulk modulus due to what the balance omits if make-up valves have no cracking range,
as in a log that the plain form does not explain. The most likely value on 71 validation logs [fraction]."""

STRUCTURE_FILTERED = 1e-3
"""The same if pressure was filtered, since the filter is fitted as a first-order lag: bulk modulus is 0.1 % too low in
16 training logs with a moving average of 2 to 6 ms."""

STRUCTURE_WITH_AIR = 2e-3
"""The same if the oil contains air. Bubbles that enter within a log are modelled as isothermal (exponent 1), and quick
compression reaches 1.4. In 16 training logs with a true exponent of 1.3 the error is 0.15 % root mean square, 0.4 % at
most (decision 249). All other air has one exponent at any speed and pressure, see decision 362."""

STRUCTURE_WITH_LOSS = 3e-3
"""The same if a loss depends on a measured signal, whose assumed shape is not quite the real one [fraction]; judged."""

BALANCE_TEMPER = 1.4
"""Divisor of log-likelihood differences between balances [dimensionless]: balances omit less than the motion form does.
Together with `PRIOR_BY_MASS` the most likely value on 876 logs of our plants and of the open benchmark."""

PRIOR_BY_MASS = 2.0
"""Prior weight of the balance by mass, if that of each other balance is 1 [dimensionless]. Oil is denser under
pressure, but simulators and textbooks balance volumes."""


def fit_flow(
    record: Record,
    parameters: EhaParameters,
    bulk_modulus: float,
    uncertainties: Mapping[str, float] | None = None,
    variances: Mapping[str, float] | None = None,
    traits: LogTraits = AT_REST,
) -> FormFit:
    """Fit the flow form to a log, balanced by volume, by mass, and by volume in held chambers, and weigh the three.

    1. Gross outliers are removed. The volume pumped in a gap of motor speed is found from the pressure after it.
    2. The pump's flow ripple is fitted (`estimation.fits.hypothesis_search.pump_ripple_fits`).
    3. If the plain form does not explain the log, effects of rig, oil and logger are tested (`explain`).
    4. The log is fitted again if an effect leads to a lower minimum, or if position noise matters in its stiff oil.
    5. A slow log with an effect is also fitted with its turns read from later samples (`agreed_answer`); a log that
       does not match the rig is tested for wrong signs and units (`CorrectedLogs`).

    A fit is not believed if its search reached the limit of work (`greybox.work_limit`).

    Parameters
    ----------
    record : Record
        The log, with position and differential pressure.
    parameters : EhaParameters
        Geometry and pump are taken from it; leakage and flow bias are first guesses.
    bulk_modulus : float
        First guess of effective bulk modulus [Pa].
    uncertainties : Mapping[str, float], optional
        Relative standard deviation of the actuator's parameters [fraction]; none by default.
    variances : Mapping[str, float], optional
        Measurement variances of the channels of a log without gross outliers [SI squared]; found here if not given.
    traits : LogTraits
        How the log begins, and how it was logged.

    Returns
    -------
    FormFit
        The best of several starts.

    Raises
    ------
    LogError
        If a channel is missing.
    """
    require_flow_channels(record)
    sensed = sensed_play(record)
    if variances is None:
        record, variances = without_strays(record)
    start = FitStart(parameters, bulk_modulus)
    placed, unplaced = placed_means(Logged(record, variances, uncertainties or {}), start, traits.averaged)
    work, tried = Work(), [CorrectedLogs(one, parameters) for one in placed]
    corrected, answer = first_explained(tried, lambda one: _answer(one, start, sensed, traits, work))
    if answer.asked and answer.plain.turns_readable and not answer.ended:
        start = replace(answer.plain.start, turns_read=True)
        answer = agreed_answer(answer, _answer(corrected, start, sensed, traits, work))
    plain, asked, open_ends, strange, ended = answer
    slip = loss = None
    try:
        with work.counted():
            slip = corrected.misread(plain, plain.best if strange is None else strange.fit)
            if slip is None and strange is None and len(asked) >= len(HYPOTHESES) and not ended:
                loss = _varying_loss(plain, traits)
    except WorkSpentError:
        ended = True
    if slip is not None:
        return replace(_plain_fit(plain, sensed, (), begun=False), reasons=(slip,))
    if loss is not None:
        return _fit_with_loss(plain, loss, sensed)
    if strange is not None:
        fit = _explained_fit(plain, strange, sensed, traits)
    else:
        fit = _plain_fit(plain, sensed, (*open_ends, *shut_valves(plain, traits)), begun=BEGUN_UNDER_LOAD in asked)
    late = corrected.logged.mean.late_rows * record.sample_time
    begun = (BEGUN_UNDER_LOAD,) if traits.loaded or traits.moving else ()
    swapped = swapped_sides(plain, strange, corrected.logged, begun, lambda one, these: _ask(one, these, traits)[0])
    told = with_structure(fit.parameters, unplaced)
    fit = replace(fit, mean_late=late, parameters=told, reasons=(*swapped, *fit.reasons))
    return replace(fit, reasons=(*fit.reasons, EstimateCode.SEARCH_ENDED.note())) if ended else fit


def _answer(corrected: CorrectedLogs, start: FitStart, sensed: ShownPlay, traits: LogTraits, work: Work) -> LogAnswer:
    """Return what a log says, fitted again for as long as that leads elsewhere; a misread log is not tested further."""
    logged = corrected.logged
    while True:
        plain = plain_fits(logged, start)
        if (stiff := with_stiff_oil(logged, plain)) is not None:
            start = replace(start, parameters=stiff, bulk_modulus=stiff.bulk_modulus, valley=None)
            continue
        if (implicit := with_implicit_steps(plain)) is not None:
            start = implicit
            continue
        plain = with_motor_course(logged, plain)
        asked, open_ends = _asked(plain, sensed, traits)
        hints: Sequence[Note] = ()
        try:
            with work.counted():
                if not start.turns_read and _is_misread(corrected, plain, asked, traits):
                    return LogAnswer(plain, (), (), None)
                strange, hints = _ask(plain, asked, traits) if asked else (None, ())
                for one in hypotheses_tested_alone(plain, asked):
                    strange = likelier_of(strange, _ask(plain, (one,), traits)[0])
                plain, strange = settled_offset(plain, strange, asked, lambda one, these: _ask(one, these, traits)[0])
                if asked and strange is None:
                    plain = with_open_turns(logged, plain)
        except WorkSpentError:
            return LogAnswer(plain, asked, (*open_ends, *hints), None, ended=True)
        if (elsewhere := strange and (_plain_start(plain, strange) or quieter_start(plain, strange.fit))) is None:
            return LogAnswer(plain, asked, (*open_ends, *hints), strange)
        start = elsewhere  # keeps the course of the motor that was found


def _is_misread(corrected: CorrectedLogs, plain: PlainFits, asked: Sequence[Hypothesis], traits: LogTraits) -> bool:
    """Return whether slips of sign or unit explain a log, and no effect that cannot be such a slip does."""
    if corrected.misread(plain, plain.best, paired=not corrected.is_kin(plain, plain.best)) is None:
        return False
    unlike = [one for one in asked if one.name in UNLIKE_SLIPS]
    strange = None if plain.explains(plain.best) or not unlike else _ask(plain, unlike, traits)[0]
    return strange is None or not corrected.is_sound(plain, strange)


def _asked(plain: PlainFits, sensed: ShownPlay, traits: LogTraits) -> tuple[Sequence[Hypothesis], Sequence[Note]]:
    """Return the hypotheses to test beside the plain form, and notes on what the log leaves undecided."""
    loaded, moving, worth = traits.loaded, traits.moving, wanted_gain(plain)
    asked, open_ends = hypotheses_asked(
        plain.log, plain.start.parameters, plain.swinging, plain.best, sensed, loaded=loaded, moving=moving, worth=worth
    )
    if traits.speed_held and not plain.explains(plain.swinging):
        return (), open_ends
    if traits.filtered and PRESSURE_LATE not in asked:
        asked = (PRESSURE_LATE, *asked)
    return asked, open_ends


def _ask(plain: PlainFits, asked: Sequence[Hypothesis], traits: LogTraits) -> tuple[Explanation | None, Sequence[Note]]:
    """Return the hypotheses that explain a log, if believed, else hints at what nearly does; a start load is alone."""
    explains = explanation_test(plain, begun=BEGUN_UNDER_LOAD in asked)
    moving, astray = traits.loaded or traits.moving, is_astray(plain.log, plain.swinging, plain.start.parameters)
    near = near_starts(plain.swinging, plain.starts, explains, in_motion=moving, astray=astray)
    if plain.best is not plain.swinging and explains(plain.best):
        near = [plain.best.values, *near]
    alone = len(asked) == 1 and asked[0] in (*ALWAYS_ASKED, ZERO_HIDDEN)  # no other hypothesis competes with it
    strange = explain(
        with_ripple_test(plain.log),
        plain.start.parameters,
        near,
        explains,
        asked=asked,
        paired=any(one not in (*UNPAIRED, moving or BEGUN_UNDER_LOAD) for one in asked),
        hopeless=hopeless_cost(plain.swinging, asked),
        by_mass=balances_mass(plain.swinging.model),
        homed=homed_at_stop(plain.log),
        useful=wanted_cost_in((asked[0].name,), plain, traits, 0.0) if alone else np.inf,
    )
    return (None, ()) if strange is None else judged(plain, strange, traits, explains)


def _varying_loss(plain: PlainFits, traits: LogTraits) -> VaryingLoss | None:
    """Return the loss that depends on a measured signal, if only that explains the log."""
    log, best = plain.log, plain.best
    if plain.explains(best) or log.gaps.size or log.passes_on or traits.loaded or len(log.drives) > LONGEST_TESTED:
        return None
    starts = [plain.swinging.values, *(one for one in plain.starts if one["makeup_conductance"] == MAKEUP_TRIED[0])]
    largest, _ = residual_limits(log.passes_on, best.seen)
    return varying_loss(log, plain.start.parameters, starts, plain.explains, best.cost, largest)


def _fit_with_loss(plain: PlainFits, loss: VaryingLoss, sensed: ShownPlay) -> FormFit:
    """Return the result of a log that a varying loss explains."""
    one = loss.fit
    untaken, open_play = plain.play_untaken(one.play, sensed)
    found = {name: (each, one.std[name]) for name, each in one.values.items()}
    found, correlation = with_lumped(found, [one], np.ones(1), plain.start.parameters, plain.log.measured_rms)
    return FormFit(
        parameters=with_structure(found, float(np.linalg.norm([STRUCTURE_WITH_LOSS, untaken, loss.opened]))),
        bound=one.std["bulk_modulus"] / one.values["bulk_modulus"],
        chi_square=one.chi_square[0],
        reasons=omitted_play_note(one.play, sensed),
        rig_slopes=with_lumped_slopes(one.rig_slopes),
        remarks=(*plain.teeth, *loss_notes(loss), *open_play),
        turning=plain.turning,
        correlation=correlation,
    )


def _plain_start(plain: PlainFits, strange: Explanation) -> FitStart | None:
    """Return where the plain form explains the log better than the hypotheses do; None if nowhere."""
    start, cost = plain.start, strange.fit.cost
    displacement = start.parameters.pump_displacement
    if not start.speed_offset and (
        turned := speed_offset_instead(plain.unturned, plain.fitted, strange.values, displacement, cost - REQUIRED_GAIN)
    ):
        return replace(start, speed_offset=turned, valley=None)
    if start.valley is not None:
        return None
    lower = lower_minimum(plain.log, start.parameters, plain.swinging, strange.values, cost + REQUIRED_GAIN)
    return None if lower is None else replace(start, valley=lower)


def _explained_fit(plain: PlainFits, strange: Explanation, sensed: ShownPlay, traits: LogTraits) -> FormFit:
    """Return the fit of a log with its unusual effects corrected."""
    strange = strange.in_detail
    one, p = strange.fit, plain.start.parameters
    modulus, bound = one.values["bulk_modulus"], explained_bound(strange, plain.best)
    if PLAY.name in strange.names:
        moved = abs(modulus / plain.swinging.values["bulk_modulus"] - 1.0)
        left, open_play = play_structure(moved, plain.yields(sensed, modulus)), ()
        shown = omitted_play_note(one.play, NO_PLAY)
    else:
        untaken, open_play = plain.play_untaken(one.play, sensed)
        left = float(np.hypot(STRUCTURE_FILTERED if traits.filtered else STRUCTURE, untaken))
        shown = omitted_play_note(one.play, sensed)
    doubts = [left, ratio_doubt(strange, plain.log.uncertainties), omitted_delay_doubt(one.late)]
    doubts += [UNEVEN_OIL] if is_single(strange.values, p.area_difference) else []
    doubts += [STRUCTURE_WITH_AIR] if {AIR.name, AIR_MIDWAY.name} & set(strange.names) else []
    left = float(np.linalg.norm(doubts))
    unseen = () if MAKEUP_BLOCKED.name in strange.names else unseen_valve_note(one)
    most = share_lost(plain.log, one.values, p.pump_displacement, strange.names)
    found, correlation = with_lumped(strange.values, strange.fits, strange.weights, p, plain.log.measured_rms)
    return FormFit(
        parameters=with_structure(with_shifts(found, one.small_teeth, one.noise_shift), left),
        bound=bound,
        chi_square=one.chi_square[0],
        reasons=(*shown, *delivery_objection(strange, p)),
        rig_slopes=with_lumped_slopes(one.rig_slopes),
        explanation=strange,
        remarks=(*plain.teeth, *open_wear_note(strange.delivery_open, most), *unseen, *open_play),
        turning=plain.turning,
        correlation=correlation,
    )


def _plain_fit(plain: PlainFits, sensed: ShownPlay, open_ends: Sequence[Note], *, begun: bool) -> FormFit:
    """Return the result of a log that the plain form is believed to explain."""
    best, p = plain.best, plain.start.parameters
    priors = [PRIOR_BY_MASS if balances_mass(fit.model) else 1.0 for fit in plain.fits]
    weights = weights_of(plain.fits, BALANCE_TEMPER * plain.log.turn_count, priors)
    found, correlation = with_lumped(model_mean(plain.fits, weights), plain.fits, weights, p, plain.log.measured_rms)
    found = with_shifts(found, best.small_teeth, best.noise_shift)
    sure = CRACKS[0] in best.values or best.model.rates is HELD_FLOW_FORM.rates
    left = max(UNEVEN_OIL if p.single_rod else DISCRETISED, 0.0 if sure else STRUCTURE)
    untaken, open_play = plain.play_untaken(plain.swinging.play, sensed)
    reasons = objections_and_play(best, plain.log.passes_on, plain.swinging.play, sensed) or plain.teeth_left
    if begun and not reasons and not explanation_test(plain, begun=begun)(best):
        reasons = (EstimateCode.PRESSURE_RESIDUALS_LARGE.note(ratio=best.chi_square[0] ** 0.5),)
    (value, std), gas = found["bulk_modulus"], () if reasons else gas_contradicted(plain.log, plain.swinging, p)
    doubts = [left, untaken, omitted_delay_doubt(best.late), unlikely_volume_doubt(open_ends)]
    return FormFit(
        parameters=with_structure(found, float(np.linalg.norm(doubts))),
        bound=std / value,
        chi_square=best.chi_square[0],
        reasons=reasons,
        rig_slopes=with_lumped_slopes(best.rig_slopes),
        remarks=(*plain.teeth, *open_ends, *unseen_valve_note(best), *gas, *open_play),
        turning=plain.turning,
        correlation=correlation,
    )
