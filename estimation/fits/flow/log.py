"""`flow_log(record, parameters, ...)`: a log for the flow form, with the effect of its sensors' noise on the fit."""

import math
from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from estimation.arrays import Array
from estimation.fits.flow.accumulator import GAS, presumed_stiffness
from estimation.fits.flow.mean_rows import NO_MEAN, PressureMean
from estimation.fits.flow.pumped import with_pump_correction
from estimation.fits.greybox.block_averages import averaged_log, odd_block
from estimation.fits.greybox.intersample_doubt import OWN_NOISE, SLOW
from estimation.fits.greybox.intersample_speed import straight_line_speed
from estimation.fits.greybox.leaked_noise import encoder_noise
from estimation.fits.greybox.log import GreyBoxLog, greybox_log
from estimation.fits.hypothesis_search.fault_guesses import leakage_guess, leakage_range
from estimation.fits.hypothesis_search.form_fit import LONGEST_STEP
from estimation.log_checks.bridging import bridged, within_gaps
from estimation.log_checks.dropout import LONG_GAP, without_pauses
from estimation.log_checks.measurement_noise import measurement_variances, noise_behind_motion, position_variance
from estimation.log_checks.order import median
from estimation.log_checks.outliers import without_outliers
from estimation.models.completed_flow import CRACKS
from estimation.models.flow import FLOW_FORM
from estimation.models.flow_parameters import flow_parameters
from estimation.models.inner_circuit import BEND
from estimation.stretches import stretches
from plant.eha.model import EhaParameters, piston_areas
from plant.errors import LogError
from plant.log.record import Record

FLOW_CHANNELS = ("position_m", "differential_pressure_pa")
"""Channels that the flow form needs beside motor speed."""

OPENING_START = 1e3
"""First guess of the drop at which a make-up check valve is half open [Pa]."""

DRAIN_START = 0.05
"""First guess of the pump's case drain, as a share of the healthy leakage [fraction]."""

PRESUMED_STD = 1.0
"""Prior standard deviation of the logarithms of the last two [dimensionless]. If make-up valves never open, no log can
distinguish a drain from leakage, and any drain would fit. A drain is doubted more where worn seals may leak hundreds of
times as much as sound ones, see `leakage_range`."""

WITHIN: Mapping[str, float] = {"makeup_conductance": math.log(100.0)}
"""Standard deviation of the logarithm of a make-up valve's conductance about the value that a search finds
[dimensionless], judged: two factors of ten. If a valve hardly matters, slopes alone allow factors of e^30, which no
valve has, and the leakage would vary along with them."""

MOST_LEAD = 0.25
"""Prior standard deviation of the motor's lead, over the sample time [dimensionless]. The lead is a twelfth of the
sample time over the motor's lag, so only a motor that settles within one sample leads by more."""

LARGEST_SWEPT = 0.7
"""Largest share of a chamber that the piston is believed to sweep [fraction]: the encoder's zero may be anywhere."""

FELT_GAP = 0.1
"""A gap in speed matters if its unknown volume moves pressure by at least this share of the pressure noise
[fraction]."""

FELT_NOISE = 0.1
"""Position noise matters to the slopes if it moves pressure by this share of the sensor's noise [fraction]."""

STIFFEST_OIL = 5e9
"""Bulk modulus above that of any hydraulic fluid [Pa]; mineral oil without air has 2 GPa, and 3 at 100 MPa."""

BESIDE_STOP = 0.02
"""Share of its travel that an encoder homed at an end stop may read beyond the stop, which is soft. Also the largest
first reading of a log that begins in mid-stroke, where the reading should be zero [fraction]."""

NOISY_BLOCK = 5e-3
"""Length over which residuals are averaged then [s]: their information on bulk modulus is slower than the noise. With 1
ms, 50 um of noise put bulk modulus of leaky actuators up to 4 % low; with 5 ms, 2.5 %."""


def require_flow_channels(record: Record) -> None:
    """Refuse a record that lacks a channel of the flow form.

    Raises
    ------
    LogError
        If one is missing.
    """
    lacking = [channel for channel in FLOW_CHANNELS if channel not in record]
    if lacking:
        raise LogError(f"the flow form needs {' and '.join(FLOW_CHANNELS)}; the log has no {' and no '.join(lacking)}")


def without_strays(record: Record) -> tuple[Record, Mapping[str, float]]:
    """Return the flow form's channels without gross outliers, and their variances.

    Parameters
    ----------
    record : Record
        A log that has them.

    Returns
    -------
    tuple of (Record, Mapping[str, float])
        The channels, and the variance of each [SI squared].
    """
    channels = (*FLOW_FORM.drives, *FLOW_FORM.outputs)
    noise = measurement_variances(record, channels)
    sound = {name: without_outliers(record[name], noise[name] ** 0.5) for name in channels}
    record = Record(record.sample_time, sound, start_time=record.start_time)
    return record, measurement_variances(record, channels)


def speed_gaps(record: Record, parameters: EhaParameters, noise: float) -> Array:
    """Return the gaps of motor speed in which the unknown pumped volume matters to the pressure.

    Parameters
    ----------
    noise : float
        Standard deviation of the differential pressure's noise [Pa].

    Returns
    -------
    ndarray, shape (gaps, 3)
        As `GreyBoxLog.gaps`, in pressure [Pa squared].
    """
    missing = np.isnan(record["motor_speed_rad_s"])
    first, after = stretches(missing)
    speed, last, length = bridged(record["motor_speed_rad_s"]), len(missing) - 1, after - first
    before, further, behind = np.maximum(first - 1, 0), np.maximum(first - 2, 0), np.minimum(after, last)
    # a straight line is right if the speed crosses the gap at the mean of its slopes before and after it
    slopes = 0.5 * (speed[before] - speed[further] + speed[np.minimum(after + 1, last)] - speed[behind])
    sudden = np.abs(speed[behind] - speed[before] - slopes * (length + 1))
    sudden = np.where(length < LONG_GAP, sudden, np.maximum(sudden, np.std(speed)))
    stiffness = parameters.bulk_modulus / parameters.chamber_volume * parameters.pump_displacement
    open_by = 0.5 * stiffness * sudden * length * record.sample_time
    open_gaps = np.array([first, behind, open_by**2 / (length + 1)], dtype=np.float64)
    return np.ascontiguousarray(open_gaps[:, open_by > FELT_GAP * noise].T)


def flow_log(
    record: Record,
    parameters: EhaParameters,
    uncertainties: Mapping[str, float],
    variances: Mapping[str, float],
    *,
    held: bool = False,
    mean: PressureMean = NO_MEAN,
) -> GreyBoxLog:
    """Return a log for the flow form.

    Position is an input with noise, and the model takes its error for compressed oil. If that matters beside the
    pressure sensor's own noise, the output noise gets a part proportional to bulk modulus. So the fit does not mistake
    encoder noise for soft oil.

    Parameters
    ----------
    record : Record
        The log, without gross outliers.
    uncertainties : Mapping[str, float]
        Relative standard deviation of the actuator's parameters [fraction].
    variances : Mapping[str, float]
        Of the noise of the channels [SI squared].
    held : bool
        Whether the motor's course bends at the samples, see `estimation.fits.flow.motor_course`.
    mean : PressureMean
        Rows that each pressure is the mean of.

    Returns
    -------
    GreyBoxLog
        Averaged if it is faster than the form needs.
    """
    sensed = mean.begun(record)
    record = without_pauses(sensed)
    # motor speed keeps its larger variance, with sudden changes, so that intervals cover its course
    pressure = "differential_pressure_pa"
    quiet = {pressure: noise_behind_motion(sensed[pressure], variances[pressure])}
    log = mean.spread(
        greybox_log(
            FLOW_FORM,
            record,
            flow_parameters(parameters),
            longest_step=LONGEST_STEP,
            variances={**variances, **quiet},
            # the accumulator's stiffness is fitted
            uncertainties={name: one for name, one in uncertainties.items() if name != GAS},
        )
    )
    speed, position = (FLOW_FORM.drives.index(name) for name in ("motor_speed_rad_s", "position_m"))
    drives = log.drives.copy()
    if not held:
        drives[:, speed] = straight_line_speed(log.drives[:, speed], slow=record.sample_time >= SLOW)
    passed_on = _swept_share(log.drives[:, position], parameters) * position_variance(sensed["position_m"]) ** 0.5
    open_gaps = speed_gaps(record, parameters, variances["differential_pressure_pa"] ** 0.5)
    log = replace(
        log,
        noise=(replace(log.noise[0], passed_on=passed_on, passed_by="bulk_modulus"),),
        timed=(*FLOW_FORM.drives, *FLOW_FORM.outputs),
        drive_std=(log.drive_std[0], 0.0),  # the output noise includes position noise
        # the piston's place is unknown within a gap of its position, but known after it
        drives=_with_gaps_balanced(open_gaps, record, drives, parameters),
        measured=np.where(within_gaps(record["position_m"])[:, None], np.nan, log.measured),
        gaps=open_gaps,
        presumed={
            "case_leakage": (DRAIN_START * leakage_guess(parameters), PRESUMED_STD * leakage_range(parameters)),
            "makeup_opening": (OPENING_START, PRESUMED_STD),
            "speed_lead": (0.0, MOST_LEAD * record.sample_time / dict(FLOW_FORM.linear)["speed_lead"]),
            **dict.fromkeys((*CRACKS, BEND), (0.0, 1.0)),
            **presumed_stiffness(parameters, uncertainties),
        },
        within=WITHIN,
    )
    log = with_pump_correction(
        averaged_log(log, LONGEST_STEP, mean.block_of(log, _samples_per_block(log, parameters))), log, parameters
    )
    felt = log.noise[0].passed_on * parameters.bulk_modulus > FELT_NOISE * log.noise[0].variance ** 0.5
    return mean.judged(
        _with_leaking_noise(log, parameters, record) if felt else log.with_noise_at(parameters.bulk_modulus)
    )


def _with_leaking_noise(log: GreyBoxLog, p: EhaParameters, record: Record) -> GreyBoxLog:
    """Return a log whose output noise has a part that grows with the oil's stiffness and decays by leakage.

    A position error ``d`` compresses oil by ``b A d / V``, which leaks off within ``V / (b L)``. So means over ``T``
    are off by at most ``A d / (L T)``, however stiff the oil. Without that bound, oil as stiff as steel explained any
    log of a leaky actuator. How the noise grows below the bound matters as much; it depends on the correlation of
    successive encoder errors.
    """
    averaged_over, samples = round(log.sample_time / record.sample_time), max(1, round(NOISY_BLOCK / log.sample_time))
    position, speed = record["position_m"], bridged(record["motor_speed_rad_s"])
    pumped = p.pump_displacement / p.piston_area * record.sample_time * np.cumsum(speed)
    rows = np.flatnonzero(np.isfinite(log.measured[:, 0]))
    every = min(round(float(median(np.diff(rows)))), samples) if rows.size > 1 else 1  # the median ignores a single gap
    leaked = encoder_noise(position, pumped, position_variance(position), averaged_over, samples, every)
    noise = replace(
        log.noise[0],
        passed_over=("chamber_volume", p.chamber_volume),
        lost_by=("leakage_coefficient", "case_leakage"),
        lost=log.sample_time / p.chamber_volume,
        lost_from=leaked,
    )
    return replace(log, noise=(noise,), block=NOISY_BLOCK)


def with_random_walk(
    log: GreyBoxLog, parameters: EhaParameters, values: Mapping[str, float], stiffest: float = STIFFEST_OIL
) -> GreyBoxLog:
    """Return a log in which noise of motor speed adds a random walk to the pressure.

    The model pumps oil according to the noisy speed, and the surplus stays until it has leaked off. In a sum of squared
    residuals, softer oil and a larger leakage then look better than the true ones, since they keep less of the surplus.

    Parameters
    ----------
    log : GreyBoxLog
        The log, as the flow form sees it.
    values : Mapping[str, float]
        Bulk modulus and leakage coefficient of a first fit [SI].
    stiffest : float
        Largest bulk modulus for which the walk is computed [Pa].

    Returns
    -------
    GreyBoxLog
        The same log if the walk does not matter beside the pressure sensor's noise before the oil has leaked off.
    """
    (noise,), stiffness = log.noise, min(values["bulk_modulus"], stiffest) / parameters.chamber_volume
    speed = log.drives[:, FLOW_FORM.drives.index("motor_speed_rad_s")]
    variance = noise_behind_motion(speed, log.drive_std[0] ** 2)
    walk = (stiffness * parameters.pump_displacement) ** 2 * variance * log.sample_time
    remembered = 0.5 / max(stiffness * values["leakage_coefficient"], 1.0 / (len(log.drives) * log.sample_time))
    felt = walk * remembered > FELT_NOISE**2 * noise.variance
    return replace(log, noise=(replace(noise, walk=walk),)) if felt else log


def homed_at_stop(log: GreyBoxLog) -> bool:
    """Return whether an encoder may have been homed at an end stop: all readings have one sign, the first is not zero.

    Parameters
    ----------
    log : GreyBoxLog
        The log, as the flow form sees it.
    """
    read = log.drives[:, FLOW_FORM.drives.index("position_m")]
    low, high = float(np.min(read)), float(np.max(read))
    beside = BESIDE_STOP * (high - low)
    return min(max(-low, 0.0), max(high, 0.0)) <= beside < abs(float(read[0]))


def _samples_per_block(log: GreyBoxLog, p: EhaParameters) -> int:
    """Return over how many samples a fast log is averaged: as many as keep corners of the pumped flow negligible.

    The loss of the pump is zero for a moment where the motor reverses, and the course of its speed has a corner where
    it starts. Means over a time ``T`` in which speed changes by ``w`` have a volume error of ``D w T / 8`` there. That
    is little oil, but small chambers of stiff oil show it.
    """
    speed, (noise,) = log.drives[:, FLOW_FORM.drives.index("motor_speed_rad_s")], log.noise
    rise = p.pump_displacement * p.bulk_modulus / p.chamber_volume
    sensed = float(np.hypot(noise.variance**0.5, noise.passed_on * p.bulk_modulus))
    block = odd_block(log.sample_time)
    while 1 < block < len(speed):
        changed = float(np.max(np.abs(speed[block:] - speed[:-block]))) - OWN_NOISE * log.drive_std[0]
        if rise * changed * block * log.sample_time / 8.0 <= sensed / block**0.5:
            break
        block -= 2
    return block


def _swept_share(position: Array, p: EhaParameters) -> float:
    """Return the relative change of volume per piston travel, summed over both chambers, root mean square [1/m]."""
    area_1, area_2 = piston_areas(p)
    volume = 2.0 * p.chamber_volume
    swept = [
        np.clip(area * side * position / volume, -LARGEST_SWEPT, LARGEST_SWEPT)
        for area, side in ((area_1, 1), (area_2, -1))
    ]
    shares = area_1 / (1.0 + swept[0]) + area_2 / (1.0 + swept[1])
    return float(np.sqrt(np.mean(shares**2))) / volume


def _with_gaps_balanced(open_gaps: Array, record: Record, drives: Array, p: EhaParameters) -> Array:
    """Return the drives with speeds in gaps that deliver what the piston sweeps, plus compression and leakage.

    These follow well enough from the ends of a gap and the rig file. Speeds on a straight line across the gap may
    deliver so much less that a chamber of the model draws oil in through a make-up valve. No other valve lets it out
    again, so it would stay.
    """
    speed, position = (FLOW_FORM.drives.index(name) for name in ("motor_speed_rad_s", "position_m"))
    out, pressure = drives.copy(), bridged(record["differential_pressure_pa"])
    missing = np.isnan(record["motor_speed_rad_s"])
    for first, behind, _ in open_gaps:
        before, after = int(first) - 1, int(behind)
        if before < 0 or missing[after]:
            continue  # a gap at an end of the log has only one known end
        length = (after - before) * record.sample_time
        swept = p.piston_area * (drives[after, position] - drives[before, position])
        yielded = p.chamber_volume / p.bulk_modulus * (pressure[after] - pressure[before])
        leaked = p.leakage_coefficient * 0.5 * (pressure[after] + pressure[before]) * length
        wanted = (swept + yielded + leaked) / p.pump_displacement
        line = float(np.trapezoid(drives[before : after + 1, speed], dx=record.sample_time))
        out[before + 1 : after, speed] += (wanted - line) / ((after - before - 1) * record.sample_time)
    return out
