"""Runs in a peer's own environment, without this project: fits a set, writes the free run on its tests.

``python identification_sets_peer.py PEER SET.npz RESULT.npz SECONDS``; it stops after SECONDS of processor time.
"""

import resource
import sys
import warnings

import numpy as np


def state_space_run(A, B, C, D, u, y):
    """Return the free run from the initial state that fits the measured output best."""
    n = A.shape[0]
    x, free, driven = np.zeros(n), np.zeros((len(u), n)), np.zeros(len(u))
    power = np.eye(n)
    for t in range(len(u)):
        driven[t] = (C @ x + D @ u[t])[0]
        x = A @ x + B @ u[t]
        free[t] = (C @ power)[0]
        power = A @ power
    known = np.isfinite(y)
    start = np.linalg.lstsq(free[known], (y - driven)[known], rcond=None)[0]
    return driven + free @ start


def growth(A, tests):
    """Return the growth factor of a state over the longest test: if large, it follows outputs, not inputs."""
    radius = float(np.abs(np.linalg.eigvals(A)).max())
    with np.errstate(over="ignore"):
        return radius ** max(len(u) for u, _ in tests)


def size_by_held_out(fit, run, sizes, u, y):
    """Return the size with the best free run on the last third, fitted to the rest."""
    cut = 2 * len(y) // 3
    errors = {}
    for size in sizes:
        try:
            found = run(fit(u[:cut], y[:cut], size), u[cut:], y[cut:])
            errors[size] = float(np.mean((found - y[cut:]) ** 2))
        except Exception:
            errors[size] = np.inf
        if not np.isfinite(errors[size]):
            errors[size] = np.inf
    return min(errors, key=errors.get)


def sippy(u, y, tests):
    """N4SID of sippy-unipi; its order, and whether it is forced to be stable, are chosen on the last third."""
    from sippy_unipi import system_identification

    def fit(u, y, size):
        n, stable = size
        found = system_identification(y, u.T, "N4SID", SS_fixed_order=n, SS_A_stability=stable)
        return [np.asarray(one) for one in (found.A, found.B, found.C, found.D)]

    def run(model, u, y):
        return state_space_run(*model, u, y)

    n, stable = size_by_held_out(fit, run, [(n, stable) for stable in (False, True) for n in (1, 2, 3, 4, 5, 6)], u, y)
    try:
        model = fit(u, y, (n, stable))
        return [run(model, *test) for test in tests], growth(model[0], tests)
    except np.linalg.LinAlgError:  # stable when fitted to two thirds, but overflows when fitted to all
        model = fit(u, y, (n, True))
        return [run(model, *test) for test in tests], growth(model[0], tests)


def jax_sysid(u, y, tests):
    """Linear state space of jax-sysid by simulation error; the order is chosen on the last third."""
    import jax
    from jax_sysid.models import LinearModel

    jax.config.update("jax_enable_x64", True)

    def fit(u, y, n):
        model = LinearModel(n, 1, u.shape[1], feedthrough=True)
        model.loss(rho_x0=1e-8, rho_th=1e-8)
        model.optimization(adam_epochs=500, lbfgs_epochs=1000, iprint=-1)
        model.fit(y.reshape(-1, 1), u)
        return [np.asarray(one, dtype=float) for one in model.ssdata()]

    def run(model, u, y):
        return state_space_run(*model, u, y)

    model = fit(u, y, size_by_held_out(fit, run, (2, 4), u, y))
    return [run(model, *test) for test in tests], growth(model[0], tests)


def jax_sysid_nonlinear(u, y, tests):
    """Nonlinear state space of jax-sysid: a linear part and a layer of tanh; states are chosen on the last third."""
    import jax
    import jax.numpy as jnp
    from jax_sysid.models import Model

    jax.config.update("jax_enable_x64", True)
    hidden, m = 8, u.shape[1]

    def state(x, u, params):
        A, B, W, V, b = params[:5]
        return A @ x + B @ u + W @ jnp.tanh(V @ jnp.hstack((x, u)) + b)

    def output(x, u, params):
        C, D, c, W, V, b = params[5:]
        return C @ x + D @ u + c + W @ jnp.tanh(V @ jnp.hstack((x, u)) + b)

    def fit(u, y, n):
        rng = np.random.default_rng(0)
        layers = [
            (0.1 * rng.normal(size=(one, hidden)), rng.normal(size=(hidden, n + m)), rng.normal(size=hidden))
            for one in (n, 1)
        ]
        linear = [0.9 * np.eye(n), 0.1 * rng.normal(size=(n, m))]
        readout = [rng.normal(size=(1, n)), np.zeros((1, m)), np.zeros(1)]
        model = Model(n, 1, m, state_fcn=state, output_fcn=output)
        model.init(params=[*linear, *layers[0], *readout, *layers[1]], x0=np.zeros(n))
        model.loss(rho_x0=1e-4, rho_th=1e-4)
        model.optimization(adam_eta=1e-3, adam_epochs=500, lbfgs_epochs=1000, iprint=-1)
        model.fit(y.reshape(-1, 1), u)
        return model

    def run(model, u, y):
        known = int(np.isfinite(y).sum())  # outputs are missing only at the end
        x0 = model.learn_x0(u[:known], y[:known].reshape(-1, 1), RTS_epochs=10, verbosity=False)
        return np.ravel(np.asarray(model.predict(np.asarray(x0), u)[0], dtype=float))

    model = fit(u, y, size_by_held_out(fit, run, (2, 4), u, y))
    return [run(model, *test) for test in tests], 0.0


def sysidentpy(u, y, tests):
    """Polynomial NARX of SysIdentPy by FROLS; lags and degree are chosen on the last third."""
    from sysidentpy.basis_function import Polynomial
    from sysidentpy.model_structure_selection import FROLS
    from sysidentpy.parameter_estimation import LeastSquares

    def fit(u, y, size):
        lags, degree = size
        xlag = lags if u.shape[1] == 1 else [list(range(1, lags + 1))] * u.shape[1]
        model = FROLS(
            order_selection=True,
            n_info_values=20,
            info_criteria="bic",
            estimator=LeastSquares(),
            ylag=lags,
            xlag=xlag,
            basis_function=Polynomial(degree=degree),
        )
        model.fit(X=u, y=y.reshape(-1, 1))
        return model

    def run(model, u, y):
        return np.ravel(model.predict(X=u, y=y[: model.max_lag].reshape(-1, 1)))

    sizes = [(lags, degree) for lags in (1, 2, 3, 4) for degree in (1, 2, 3) if lags * (1 + u.shape[1]) * degree < 30]
    model = fit(u, y, size_by_held_out(fit, run, sizes, u, y))
    return [run(model, *test) for test in tests], 0.0


PEERS = {
    "sippy": sippy,
    "jax-sysid": jax_sysid,
    "jax-sysid-nonlinear": jax_sysid_nonlinear,
    "sysidentpy": sysidentpy,
}


def main(name, data, result, seconds):
    """Fit one set with one peer, scaled to order one."""
    resource.setrlimit(resource.RLIMIT_CPU, (int(seconds), int(seconds) + 5))
    warnings.simplefilter("ignore")
    stored = np.load(data)
    u, y = stored["u"], stored["y"]
    u_mean, u_std, y_mean, y_std = u.mean(axis=0), u.std(axis=0), y.mean(), y.std()
    tests = [
        ((stored[f"u{k}"] - u_mean) / u_std, (stored[f"y{k}"] - y_mean) / y_std) for k in range(int(stored["tests"]))
    ]
    runs, grown = PEERS[name]((u - u_mean) / u_std, (y - y_mean) / y_std, tests)
    np.savez(
        result, growth=np.array(grown), **{f"y{k}": y_mean + y_std * np.asarray(run) for k, run in enumerate(runs)}
    )


if __name__ == "__main__":
    main(*sys.argv[1:])
