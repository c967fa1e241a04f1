"""Which fault a log of the diaphragm motor shows: its signature is compared with every fault's curve of signatures.

Each fault of `faults.diaphragm_motor.faults` traces a curve through the 29 numbers of a signature as its severity
rises. The nearest point of each curve by generalised least squares gives its severity and chi-square; the curves'
evidence, by Laplace's rule, gives its probability. Faults that one bench cannot tell apart share the probability and
are named together. If no curve comes near, the fault is unknown.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import lru_cache
from math import log, pi, sqrt

import numpy as np
from scipy.interpolate import PchipInterpolator
from scipy.optimize import minimize_scalar
from scipy.special import chdtri

from estimation.diaphragm_motor.channel_mistakes import mistakes_that_explain
from estimation.diaphragm_motor.signature import Signature, logged_signature, modelled_signature, tolerance
from estimation.finding import interval_95
from faults.diaphragm_motor.faults import HEALTHY, MOTOR_FAULTS, MotorFault, motor_with_fault
from plant.arrays import Floats
from plant.diaphragm_motor.parameters import DIAPHRAGMS, DiaphragmMotorParameters
from plant.errors import LogError
from plant.log.record import Record

UNKNOWN_BELOW = 1e-3
"""Probability of the best fault's chi-square below which the fault is called unknown."""

NAMED_TOGETHER = 0.05
"""Probability from which a fault is named together with the most probable one."""

PRIOR_HEALTHY = 0.5
"""Prior probability of a healthy motor; kinds of fault share the rest equally."""

LEAST_SEPARATION = 3.0
"""Standard deviations from which two faults count as told apart."""

LEAST_COSINE = 0.99
"""Cosine between the changes of the electrodes' fundamentals by two faults from which these look alike
[dimensionless]."""

SAME_DRIVE = 0.005
"""Largest difference in frequency and swing between a log and its healthy run [fraction] (judged)."""

LEAST_TONE = 0.1
"""Fundamental of an electrode below which a motor cannot be healthy [V] (judged)."""

LONGEST_DELAY = 0.125
"""Longest delay of the electrodes that is tried [cycles of the drive] (judged)."""

_DELAYS = 16
"""Delays of either sign that are tried before the best is sought [count]."""

_FUNDAMENTALS = 2 * DIAPHRAGMS
"""Numbers at the beginning of a signature: real parts of the electrodes' fundamentals, then imaginary ones."""

_LEAST_CHANGE = 1e-3
"""Size of a change of the fundamentals below which it has no direction [V] (judged)."""

_GRID = 201
"""Severities at which a fault's curve is evaluated before its nearest point is sought [count]."""

_KINDS = [fault.kind for fault in MOTOR_FAULTS.values()]
_KIND_PRIOR = (1.0 - PRIOR_HEALTHY) / len(set(_KINDS))

_PRIORS = {name: _KIND_PRIOR / _KINDS.count(fault.kind) for name, fault in MOTOR_FAULTS.items()}
"""Prior probability of each fault: the faults of a kind share the probability of the kind [fraction]."""


@dataclass(frozen=True)
class Match:
    """The nearest point of a fault's curve.

    Parameters
    ----------
    name : str
        The fault, or ``healthy``.
    severity : float
        Severity at that point [the fault's unit].
    deviation : float
        Its standard deviation [the fault's unit].
    chi_square : float
        Squared distance, in standard deviations squared [dimensionless].
    probability : float
        Posterior probability of the fault [fraction].
    """

    name: str
    severity: float
    deviation: float
    chi_square: float
    probability: float

    @property
    def interval(self) -> tuple[float, float]:
        """The severity's 95 % interval."""
        return interval_95(self.severity, self.deviation)


@dataclass(frozen=True)
class MotorDiagnosis:
    """Diagnosis of the motor.

    Parameters
    ----------
    matches : tuple of Match
        All hypotheses, the most probable first.
    freedom : int
        Degrees of freedom of the best hypothesis's chi-square.
    signature : Signature
        Signature of the log, converted to the model's own motor if there is a calibration.
    expected : ndarray, shape (29,)
        Signature of a healthy motor.
    lookalikes : tuple of str
        Faults that change the electrodes' fundamentals in the same direction as the best one. Those outside the group
        are told from it by velocity, second harmonics and the last few percent, so only as far as the model is exact.
    delay : float, optional
        Delay of all electrodes behind the drive without which a fault would explain an unknown log [s].
    """

    matches: tuple[Match, ...]
    unknown: bool
    freedom: int
    signature: Signature
    expected: Floats
    lookalikes: tuple[str, ...]
    delay: float | None = None

    @property
    def best(self) -> Match:
        """The most probable hypothesis."""
        return self.matches[0]

    @property
    def group(self) -> tuple[Match, ...]:
        """All hypotheses that the log leaves probable, the most probable first."""
        return (self.best, *(match for match in self.matches[1:] if match.probability >= NAMED_TOGETHER))


class _Curve:
    """A fault's signatures over its severity, whitened."""

    def __init__(self, fault: MotorFault, signatures: Floats, whitening: Floats) -> None:
        self.fault = fault
        self.at = PchipInterpolator(fault.severities, signatures @ whitening.T, axis=0)
        self.slope = self.at.derivative()
        least, most = fault.severities[0], fault.severities[-1]
        self.grid = np.linspace(least, most, _GRID)
        self.points = self.at(self.grid)

    def nearest(self, seen: Floats) -> tuple[float, float, float]:
        """Return the severity nearest to the observed signature, its standard deviation, and the squared distance."""
        nearest = int(np.argmin(np.sum((self.points - seen) ** 2, axis=1)))
        between = self.grid[max(nearest - 1, 0)], self.grid[min(nearest + 1, _GRID - 1)]
        reach = between[1] - between[0]
        found = minimize_scalar(
            lambda share: float(np.sum((self.at(between[0] + share * reach) - seen) ** 2)),
            bounds=(0.0, 1.0),
            method="bounded",
            options={"xatol": 1e-4},
        )
        severity = float(between[0] + found.x * reach)
        steepness = float(np.linalg.norm(self.slope(severity)))
        return severity, 1.0 / max(steepness, 1e-3 / (self.grid[-1] - self.grid[0])), float(found.fun)


@lru_cache(maxsize=4)
def _simulated_signatures(
    healthy: DiaphragmMotorParameters, frequency: float, peak_to_peak: float
) -> Mapping[str, Floats]:
    """Return every fault's signatures at its severities, and the healthy signature, from the model."""

    def shown(name: str, severity: float) -> Floats:
        return modelled_signature(motor_with_fault(healthy, name, severity), frequency, peak_to_peak)

    curves = {name: np.array([shown(name, s) for s in fault.severities]) for name, fault in MOTOR_FAULTS.items()}
    return curves | {HEALTHY: modelled_signature(healthy, frequency, peak_to_peak)}


def diagnose_motor(
    record: Record, healthy: DiaphragmMotorParameters, *, calibration: Signature | None = None
) -> MotorDiagnosis:
    """Return the fault that a run under a steady sine shows, its severity, and the faults it cannot be told from.

    Parameters
    ----------
    record : Record
        Drive, seven electrodes, position.
    healthy : DiaphragmMotorParameters
        The motor as it should be, at the run's load.
    calibration : Signature, optional
        Signature of this motor when it was healthy, under the same drive and load; its difference from the model is
        assumed to stay.

    Raises
    ------
    LogError
        If the log cannot be used, or the calibration is of another drive.
    """
    seen = logged_signature(record)

    def diagnosed(one: Signature) -> MotorDiagnosis:
        return diagnose_signature(
            one if calibration is None else _converted_to_model(one, calibration, healthy), healthy
        )

    found = diagnosed(seen)
    if not found.unknown:
        return found
    mistakes = mistakes_that_explain(seen, lambda one: not diagnosed(one).unknown)
    if mistakes:
        raise LogError(f"{' or '.join(mistakes)}: say so in the rig file's [columns] or by --columns")
    return replace(found, delay=_delay_that_explains(seen, diagnosed))


def _delay_that_explains(seen: Signature, diagnosed: Callable[[Signature], MotorDiagnosis]) -> float | None:
    """Return the delay of all electrodes behind the drive [s] without which a fault explains a log; None without."""
    longest = LONGEST_DELAY / seen.drive.frequency

    def chi_square(delay: float) -> float:
        return min(match.chi_square for match in diagnosed(seen.earlier(delay)).matches)

    tried = np.linspace(-longest, longest, 2 * _DELAYS + 1)
    best, step = tried[int(np.argmin([chi_square(float(one)) for one in tried]))], longest / _DELAYS
    ends = best - step, best + step
    found = minimize_scalar(chi_square, bounds=ends, method="bounded", options={"xatol": 1e-2 * step})
    return None if diagnosed(seen.earlier(float(found.x))).unknown else float(found.x)


def diagnose_signature(seen: Signature, healthy: DiaphragmMotorParameters) -> MotorDiagnosis:
    """Compare a signature with every fault's curve (`diagnose_motor`)."""
    point = _operating_point(seen)
    simulated = _simulated_signatures(healthy, *point)
    whitening = _whitening(tolerance(healthy, *point) + seen.covariance)
    white = whitening @ seen.values
    found = [(HEALTHY, 0.0, 0.0, float(np.sum((white - whitening @ simulated[HEALTHY]) ** 2)), log(PRIOR_HEALTHY))]
    for name, fault in MOTOR_FAULTS.items():
        curve = _Curve(fault, simulated[name], whitening)
        severity, deviation, distance = curve.nearest(white)
        occam = min(1.0, sqrt(2.0 * pi) * deviation / float(curve.grid[-1] - curve.grid[0]))
        found.append((name, severity, deviation, distance, log(_PRIORS[name] * occam)))
    evidence = np.array([prior - 0.5 * distance for *_, distance, prior in found])
    shares = np.exp(evidence - evidence.max())
    shares /= shares.sum()
    matches = sorted(
        (Match(*one[:4], float(share)) for one, share in zip(found, shares, strict=True)),
        key=lambda match: -match.probability,
    )
    freedom = len(white) - (matches[0].name != HEALTHY)
    unknown = min(match.chi_square for match in matches) > float(chdtri(freedom, UNKNOWN_BELOW))
    alike = _lookalikes(matches[0], healthy, point)
    return MotorDiagnosis(tuple(matches), unknown, freedom, seen, simulated[HEALTHY], alike)


def separations(
    healthy: DiaphragmMotorParameters, frequency: float, peak_to_peak: float, sizes: Mapping[str, float]
) -> Mapping[str, Mapping[str, float]]:
    """Return the distance of faults to the nearest point of any other curve: below `LEAST_SEPARATION` they look alike.

    Parameters
    ----------
    frequency, peak_to_peak : float
        Frequency and swing of the drive [Hz], [V].
    sizes : Mapping[str, float]
        Severity of each fault to be compared [the fault's unit].

    Returns
    -------
    Mapping[str, Mapping[str, float]]
        Distance in standard deviations, by fault and by other fault.
    """
    simulated = _simulated_signatures(healthy, frequency, peak_to_peak)
    whitening = _whitening(tolerance(healthy, frequency, peak_to_peak))
    curves = [_Curve(fault, simulated[name], whitening) for name, fault in MOTOR_FAULTS.items()]
    apart: dict[str, dict[str, float]] = {}
    for name, size in sizes.items():
        shown = modelled_signature(motor_with_fault(healthy, name, size), frequency, peak_to_peak)
        apart[name] = {
            curve.fault.name: sqrt(curve.nearest(whitening @ shown)[2]) for curve in curves if curve.fault.name != name
        }
        apart[name][HEALTHY] = float(np.linalg.norm(whitening @ (shown - simulated[HEALTHY])))
    return apart


def _whitening(covariance: Floats) -> Floats:
    return np.asarray(np.linalg.inv(np.linalg.cholesky(covariance)), np.float64)


def _lookalikes(best: Match, healthy: DiaphragmMotorParameters, point: tuple[float, float]) -> tuple[str, ...]:
    """Return the faults that change the fundamentals in the same direction as the best one, the nearest first."""
    if best.name == HEALTHY:
        return ()
    simulated = _simulated_signatures(healthy, *point)

    def bent(values: Floats) -> Floats:
        change = (values - simulated[HEALTHY])[..., :_FUNDAMENTALS]
        return change / np.maximum(np.linalg.norm(change, axis=-1, keepdims=True), _LEAST_CHANGE)

    curve = PchipInterpolator(MOTOR_FAULTS[best.name].severities, simulated[best.name], axis=0)
    own = bent(np.asarray(curve(best.severity)))
    cosines = {name: float(np.max(bent(simulated[name]) @ own)) for name in MOTOR_FAULTS if name != best.name}
    return tuple(name for name in sorted(cosines, key=lambda one: -cosines[one]) if cosines[name] >= LEAST_COSINE)


def _operating_point(seen: Signature) -> tuple[float, float]:
    """Return frequency and swing, rounded so that logs of one operating point share its simulations."""
    return round(seen.drive.frequency, 2), round(seen.drive.peak_to_peak, 1)


def _converted_to_model(seen: Signature, calibration: Signature, healthy: DiaphragmMotorParameters) -> Signature:
    """Return a log converted to the model's own motor: fundamentals by ratio, all else by difference."""
    was, drive = calibration.drive, seen.drive
    if (
        abs(was.frequency / drive.frequency - 1.0) > SAME_DRIVE
        or abs(was.peak_to_peak / drive.peak_to_peak - 1.0) > SAME_DRIVE
    ):
        raise LogError(
            f"the healthy run must be under the log's drive, {drive.frequency:.4g} Hz and {drive.peak_to_peak:.4g} V "
            f"peak to peak, got {was.frequency:.4g} Hz and {was.peak_to_peak:.4g} V"
        )
    if float(np.min(np.abs(calibration.tones))) < LEAST_TONE:
        raise LogError(f"the healthy run has an electrode below {LEAST_TONE:g} V: it is not of a healthy motor")
    model = modelled_signature(healthy, *_operating_point(calibration))
    turn = (model[:DIAPHRAGMS] + 1j * model[DIAPHRAGMS:_FUNDAMENTALS]) / calibration.tones
    first = seen.tones * turn
    # a delay of an electrode turns its second harmonic by twice the angle of the first one
    change = (seen.second_tones - calibration.second_tones) * turn**2 / np.abs(turn)
    second = model[_FUNDAMENTALS : 2 * _FUNDAMENTALS] + np.concatenate([change.real, change.imag])
    velocity = model[-1] + seen.velocity - calibration.velocity
    values = np.concatenate([first.real, first.imag, second, [velocity]])
    return replace(seen, values=values, covariance=seen.covariance + calibration.covariance)
