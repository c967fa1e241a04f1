"""A load on a rig whose file has the wrong pump and the wrong chambers: three effects at once."""

import pytest

from benchmarks.diagnosis.rig_draws import draw_bench, wrong_rig_file
from estimation.fits.flow.fit import fit_flow
from estimation.fits.flow.log_traits import LogTraits
from estimation.log_checks.clean import clean_log


@pytest.mark.slow
def test_a_wrong_pump_wrong_chambers_and_a_load_are_found_together() -> None:
    bench = draw_bench(1307)  # a sine of 11 s; the file's chambers are 10 % too small, pump over area 2 %
    rig = wrong_rig_file(bench.healthy, 1307)
    clean = clean_log(bench.record, rig)
    fit = fit_flow(clean.record, rig, rig.bulk_modulus, {}, clean.variances, LogTraits(loaded=True))
    assert fit.explanation is not None
    assert not fit.reasons
    assert set(fit.explanation.names) == {"delivery", "volume", "start_load"}
    found, std = fit.parameters["bulk_modulus"]
    assert abs(found - bench.true.bulk_modulus) < 3.0 * std
    delivered = fit.explanation.values["pump_displacement"][0] / rig.piston_area
    assert delivered == pytest.approx(bench.true.pump_displacement / bench.true.piston_area, rel=1e-3)
