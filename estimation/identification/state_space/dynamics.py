"""One output of a state-space model in the data's scale: its free run and its JSON form."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from estimation.arrays import Array
from estimation.identification.free_run.data import Scaling
from estimation.identification.free_run.dynamics import OutputErrorDynamics
from estimation.identification.free_run.linear_problem import undetermined_outputs
from estimation.identification.state_space.joint import delayed_inputs
from estimation.identification.state_space.kernel import run_states
from estimation.identification.state_space.system import StateSpace


@dataclass(frozen=True, eq=False)
class StateSpaceDynamics(OutputErrorDynamics):
    """One output of a state space that all outputs share.

    Parameters
    ----------
    system : StateSpace
        All outputs, scaled.
    place : int
        Which of them this is.
    """

    system: StateSpace
    place: int
    kind: ClassVar[str] = "state-space"

    @property
    def n_values(self) -> int:
        """Fitted coefficients of all outputs together."""
        return self.system.n_values

    @property
    def level(self) -> float:
        """Output if all inputs are zero [scaled]."""
        return float(self.system.level[self.place])

    def undetermined_outputs(self, length: int) -> int:
        """Return how many first outputs of a log of some length [samples] respond to inputs from before the log."""
        return undetermined_outputs(max(self.system.delays), length)

    def run(self, u: Array, y: Array) -> Array:
        """Return the free run, with the initial state by least squares from the outputs that are present.

        If these are too few, it starts at rest under the first inputs. After a long dead time it starts with the first
        output that responds to inputs of the log; that output also stands for the earlier ones.
        """
        one, n, known = self.system, self.system.order, np.isfinite(y)
        late, a = delayed_inputs(u, one.delays), np.ascontiguousarray(one.a)
        rest = np.asarray(np.linalg.lstsq(np.eye(n) - a, one.b @ late[0], rcond=None)[0], dtype=np.float64)
        states, quiet = np.empty((len(u), n)), np.zeros((len(u), n))
        run_states(a, np.ascontiguousarray(late @ one.b.T), rest, states)
        out = states @ one.c[self.place] + late @ one.d[self.place] + self.level
        if np.count_nonzero(known) <= n:
            return out
        free, begin = np.zeros((len(u), n)), self.undetermined_outputs(len(u))
        for k in range(n):
            run_states(a, quiet[begin:], np.eye(n)[k], states[begin:])
            free[begin:, k] = states[begin:] @ one.c[self.place]
        run = out + free @ np.linalg.lstsq(free[known], (y - out)[known], rcond=1e-10)[0]
        run[:begin] = run[begin : begin + 1] if begin < len(u) else out
        return run

    def transfer_functions(self) -> list[tuple[Array, Array]]:
        """Return numerator and denominator from each input [scaled], in powers of the delay operator."""
        from scipy.signal import ss2tf

        one, found = self.system, list[tuple[Array, Array]]()
        for k, delay in enumerate(one.delays):
            b, f = ss2tf(one.a, one.b, one.c[self.place][None], one.d[self.place][None], input=k)
            found.append((np.concatenate([np.zeros(delay), np.ravel(b)]), np.asarray(f, dtype=np.float64)))
        return found

    def to_dict(self) -> dict[str, Any]:
        """Return JSON values."""
        return {**self.system.to_dict(), "place": self.place}

    @classmethod
    def from_dict(cls, values: Mapping[str, Any]) -> "StateSpaceDynamics":
        """Return the dynamics that `to_dict` wrote."""
        return cls(StateSpace.from_dict(values), int(values["place"]))


def system_in_units(outputs: Sequence[StateSpaceDynamics], scalings: Sequence[Scaling]) -> StateSpace:
    """Return the state space that several outputs share, in the channels' units.

    Parameters
    ----------
    outputs, scalings : sequence of StateSpaceDynamics, sequence of Scaling
        One an output, all of them.
    """
    by = scalings[0]
    mean, std = (np.array([getattr(one, name) for one in scalings]) for name in ("y_mean", "y_std"))
    return outputs[0].system.in_units(by.u_mean, by.u_std, mean, std)
