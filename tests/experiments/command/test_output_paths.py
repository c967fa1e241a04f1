"""Each log and each output has its own figure or page, and its path is checked first."""

from pathlib import Path

import pytest

from experiments.command.output_paths import page_place, paths_by_owner, require_folder, require_place, with_page_ending
from plant.errors import HydrostateError


def test_without_an_output_option_no_log_has_an_output_file() -> None:
    assert paths_by_owner(None, [Path("run.csv")]) == {}


def test_the_output_of_one_log_has_the_given_name() -> None:
    assert paths_by_owner(Path("fit.png"), [Path("run.csv")]) == {Path("run.csv"): Path("fit.png")}
    assert paths_by_owner(Path("fit.png"), [Path("run.csv")] * 2) == {Path("run.csv"): Path("fit.png")}


@pytest.mark.parametrize(
    ("logs", "files"),
    [
        (["one.csv", "two.csv"], ["p-one.html", "p-two.html"]),
        (["a/run.csv", "b/run.csv"], ["p-a-run.html", "p-b-run.html"]),
        (["run.csv", "run.parquet"], ["p-run.csv.html", "p-run.parquet.html"]),
        (["a/x/run.csv", "b/x/run.csv"], ["p-a-x-run.html", "p-b-x-run.html"]),
        (["Run.csv", "a/run.csv", "b/other.csv"], None),
        (["a-b/run.csv", "a/b-run.csv"], ["p-run.html", "p-b-run.html"]),
    ],
)
def test_outputs_of_logs_with_equal_names_have_different_paths(logs: list[str], files: list[str] | None) -> None:
    found = paths_by_owner(Path("out/p.html"), [Path(log) for log in logs])
    assert list(found) == [Path(log) for log in logs]
    assert len({str(path).casefold() for path in found.values()}) == len(logs)
    if files is not None:
        assert list(found.values()) == [Path("out") / file for file in files]


def test_names_of_outputs_become_valid_file_names_and_equal_ones_are_numbered() -> None:
    found = paths_by_owner(Path("s.csv"), ["flow [l/min]", "flow (l/min)", "p.1", "p.2"])
    names = [path.name for path in found.values()]
    assert names == ["s-flow_l_min.csv", "s-flow_l_min-2.csv", "s-p.1.csv", "s-p.2.csv"]


def test_several_files_keep_the_ending_of_the_given_name() -> None:
    assert paths_by_owner(Path("fit"), ["a", "b"])["a"] == Path("fit-a")
    assert paths_by_owner(Path("fit.csv"), ["a", "b"])["a"] == Path("fit-a.csv")


def test_the_path_of_a_page_ends_in_html_with_any_given_ending(tmp_path: Path) -> None:
    assert page_place(None) is None
    assert page_place(tmp_path / "run") == tmp_path / "run.html"
    assert page_place(tmp_path / "run.htm") == tmp_path / "run.html"
    with pytest.raises(HydrostateError, match="--report"):
        page_place(tmp_path)


def test_a_figure_with_another_ending_than_png_is_refused(tmp_path: Path) -> None:
    require_place("--figure", tmp_path / "a.PNG", ".png")
    with pytest.raises(HydrostateError, match=r"--figure must end in \.png, got"):
        require_place("--figure", tmp_path / "a.pdf", ".png")


def test_a_folder_as_a_file_and_a_missing_folder_are_refused(tmp_path: Path) -> None:
    require_place("--figure", None)
    require_place("--figure", tmp_path / "a.png")
    with pytest.raises(HydrostateError, match="--figure must be a file, got the folder"):
        require_place("--figure", tmp_path)
    with pytest.raises(HydrostateError, match="there is no such folder"):
        require_place("--report", tmp_path / "pages" / "a.html")


def test_a_file_or_a_name_like_a_file_s_is_refused_as_a_folder(tmp_path: Path) -> None:
    (file := tmp_path / "afile").write_text("")
    (folder := tmp_path / "pages.html").mkdir()
    for fine in (None, tmp_path / "new", folder, tmp_path / "v1.2"):
        require_folder(fine)
    with pytest.raises(HydrostateError, match=r"--out must be a folder, got the file '.*afile'"):
        require_folder(file)
    with pytest.raises(
        HydrostateError, match=r"--out must be a folder, got .*fleet\.html.*, which looks like the name"
    ):
        require_folder(tmp_path / "fleet.html")
    with pytest.raises(HydrostateError, match="--out must be a file, got the folder"):
        with_page_ending("--out", folder)
