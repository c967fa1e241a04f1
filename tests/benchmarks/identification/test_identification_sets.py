"""Tests that the table of public sets lists the sets it has if a name matches none."""

import pytest

from benchmarks.identification import identification_sets
from benchmarks.identification.identification_sets_data import PublicSet


def test_an_unknown_set_name_is_refused_with_the_list_of_sets(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    there = [PublicSet("cascaded tanks", True, 4.0, None, {}), PublicSet("dryer", False, 0.08, None, {})]  # type: ignore[arg-type]
    monkeypatch.setattr(identification_sets, "public_sets", lambda wanted=(): [] if wanted else there)
    with pytest.raises(SystemExit):
        identification_sets.main(["dyer"])
    assert "no set's name has 'dyer' in it; there are cascaded tanks, dryer" in capsys.readouterr().err
    monkeypatch.setattr(identification_sets, "public_sets", lambda _=(): [])
    with pytest.raises(SystemExit):
        identification_sets.main([])
    assert "no public set in " in capsys.readouterr().err
