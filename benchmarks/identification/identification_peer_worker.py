"""Runs in a peer's own environment, without this project: fits records, writes time and model.

``python identification_peer_worker.py PEER DATA.npz RESULT.json``
"""

import json
import sys
import time
import warnings
from pathlib import Path

import numpy as np


def sippy(u, y):
    """Output error of sippy-unipi; it has no direct term, so the input is advanced by one sample."""
    from sippy_unipi import system_identification

    found = system_identification(y[:-1].copy(), u[1:].copy(), "OE", OE_orders=[3, 2, 1], OE_mod="OPT")
    b, f = np.ravel(found.NUMERATOR), np.ravel(found.DENOMINATOR)
    return b / f[0], f / f[0]


def pysib(u, y):
    """Output error of pysib."""
    import pysib as peer

    _, model = peer.oe(u, y, 3, 2, 0)
    return np.ravel(model["B"]), np.ravel(model["F"])


def pysid(u, y):
    """Output error of pysid."""
    from pysid import oe

    model = oe(2, 2, 0, u.reshape(-1, 1), y.reshape(-1, 1))
    return np.ravel(model.B[0, 0]), np.ravel(model.F[0, 0])


def jax_sysid(u, y):
    """State space of order 2 by simulation error, as in jax-sysid's documentation."""
    import jax
    from jax_sysid.models import LinearModel

    jax.config.update("jax_enable_x64", True)
    model = LinearModel(2, 1, 1, feedthrough=True)
    model.loss(rho_x0=0.0, rho_th=0.0)
    model.optimization(adam_epochs=1000, lbfgs_epochs=2000, iprint=-1)
    model.fit(y.reshape(-1, 1), u.reshape(-1, 1))
    A, B, C, D = (np.asarray(m, dtype=float) for m in model.ssdata())
    f = np.real(np.poly(A))
    return np.real(np.poly(A - B @ C)) - f + D[0, 0] * f, f


PEERS = {"sippy": sippy, "pysib": pysib, "pysid": pysid, "jax-sysid": jax_sysid}


def main(name, data, result):
    """Fit every record of the file with one peer."""
    warnings.simplefilter("ignore")
    records = np.load(data)
    rows = []
    for index in range(int(records["count"])):
        u, y = records[f"u{index}"], records[f"y{index}"]
        begun, processor = time.perf_counter(), time.process_time()
        try:
            b, f = PEERS[name](u, y)
            row = {"b": [float(x) for x in b], "f": [float(x) for x in f], "error": ""}
        except Exception as error:
            row = {"b": [], "f": [], "error": f"{type(error).__name__}: {error}"[:200]}
        row |= {"seconds": time.perf_counter() - begun, "cpu_seconds": time.process_time() - processor}
        rows.append(row)
        Path(result).write_text(json.dumps(rows))


if __name__ == "__main__":
    main(*sys.argv[1:])
