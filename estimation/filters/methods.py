"""The filters, by the names that `--method` takes; fitting a log imports none of them."""

from collections.abc import Mapping

from estimation.engine.contract import Method
from estimation.filters.ckf import ckf
from estimation.filters.ekf import ekf
from estimation.filters.filterpy_bridge import filterpy_ekf
from estimation.filters.iekf import iekf
from estimation.filters.imm import imm
from estimation.filters.iterated_smoother import iterated_smoother
from estimation.filters.particle import particle
from estimation.filters.sif import sif
from estimation.filters.smoother import smoother
from estimation.filters.svsf import svsf
from estimation.filters.ukf import ukf

METHODS: Mapping[str, Method] = {
    "ekf": ekf,
    "iekf": iekf,
    "ukf": ukf,
    "ckf": ckf,
    "svsf": svsf,
    "sif": sif,
    "imm": imm,
    "particle": particle,
    "smoother": smoother,
    "iterated-smoother": iterated_smoother,
    "filterpy-ekf": filterpy_ekf,
}
"""The filters, by name."""
