"""A set of hypotheses on trial, and the explanation of a log that results."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

import numpy as np

from estimation.fits.greybox.descent import Point
from estimation.fits.greybox.fit import GreyBoxFit
from estimation.fits.hypotheses import Hypothesis
from estimation.fits.hypothesis_search.form_fit import weights_of
from estimation.fits.hypothesis_search.predicted_gains import NO_GAIN, PredictedGain
from plant.arrays import Array


@dataclass(frozen=True, eq=False)
class Trial:
    """A set of hypotheses with the best point that its search has found.

    Parameters
    ----------
    together : tuple of Hypothesis
        The hypotheses.
    point : Point
        Where its search stands.
    values : Mapping[str, float]
        The parameters there [SI].
    delays : Mapping[str, float]
        Delays of channels beside their lags [s].
    rig : Mapping[str, float]
        Values of the rig file, with all effects absent [SI].
    fits : tuple of GreyBoxFit
        Once finished: the likelier balance first, by volume or by mass, then the other one if it counts.
    void : bool
        Whether the result no longer means what the hypotheses say.
    coarse : Mapping[str, float]
        Once finished: its values at the end of its search with long model steps [SI].
    by_mass : bool
        Once finished: whether the likelier balance is by mass.
    """

    together: tuple[Hypothesis, ...]
    point: Point
    values: Mapping[str, float]
    delays: Mapping[str, float]
    rig: Mapping[str, float]
    fits: tuple[GreyBoxFit, ...] = ()
    void: bool = False
    coarse: Mapping[str, float] = field(default_factory=dict[str, float])
    by_mass: bool = False

    @property
    def cost(self) -> float:
        """Cost of the best point, infinite if it does not mean what the hypotheses say [dimensionless]."""
        return self.point.cost if self.meant and not self.void else np.inf

    @property
    def meant(self) -> bool:
        """Whether the result means what the hypotheses say, and does not just use the unknowns that they add."""
        large = all(not one.least or abs(self.values[one.free[0]]) >= one.least for one in self.together)
        return large and all(not one.lower or self.values[one.free[0]] < self.rig[one.free[0]] for one in self.together)

    @property
    def fit(self) -> GreyBoxFit:
        """Its fit by the likelier balance."""
        return self.fits[0]


@dataclass(frozen=True, eq=False)
class Explanation:
    """Explanation of a log that the plain flow form does not fit.

    Parameters
    ----------
    names : tuple of str
        The hypotheses that were accepted together.
    values : Mapping[str, tuple of float]
        Value and standard deviation by parameter, in SI.
    delays : Mapping[str, float]
        Delays of channels beside their lags [s].
    fits : tuple of GreyBoxFit
        The fits that values are weighed over: first that under them by the likelier balance.
    rivals : tuple of str
        Other sets of hypotheses that explain the log about as well, by the names of each.
    stated_pressure : float
        Absolute pressure at which bulk modulus is stated, if the oil contains air [Pa].
    opening : callable
        Computes `delivery_open`, which needs further slopes.
    detailing : callable
        Computes `in_detail`, which needs further fits; of most explanations only the cost is read.
    priors : tuple of float, optional
        Weight of each fit before the log is seen [dimensionless]; equal ones if not given.
    """

    names: tuple[str, ...]
    values: Mapping[str, tuple[float, float]]
    delays: Mapping[str, float]
    fits: tuple[GreyBoxFit, ...]
    rivals: tuple[str, ...]
    stated_pressure: float
    opening: Callable[[], PredictedGain] = lambda: NO_GAIN
    detailing: Callable[[], "Explanation | None"] = lambda: None
    priors: tuple[float, ...] | None = None

    @property
    def fit(self) -> GreyBoxFit:
        """The fit under them."""
        return self.fits[0]

    @property
    def weights(self) -> Array:
        """The probability of each fit [fraction]."""
        return weights_of(self.fits, priors=self.priors)

    @property
    def delivery_open(self) -> PredictedGain:
        """Predicted gain of another pump delivery beside them; nothing if the delivery is part of the explanation."""
        return self.opening()

    @property
    def in_detail(self) -> "Explanation":
        """The explanation with those parameters free, too, that change its last digits only; see `with_details`."""
        return self.detailing() or self
