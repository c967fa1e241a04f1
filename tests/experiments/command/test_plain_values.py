"""Plain values reach a command as from Typer's own validators, which are imported only for other types."""

import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Any

import pytest
import typer
from typer.core import TyperGroup

from experiments.command.plain_values import accept_plain_values
from experiments.command.terminal import HydrostateGroup

GIVEN: list[dict[str, Any]] = []


def taking(group: type[TyperGroup]) -> typer.Typer:
    app = typer.Typer(cls=group)

    @app.command()
    def take(  # pyright: ignore[reportUnusedFunction] -- Typer calls it
        logs: list[Path],
        name: str = "auto",
        count: Annotated[int, typer.Option(min=0, max=5)] = 1,
        rate: float = 1.5,
        whole: float = 2,
        rig: Path | None = None,
        there: Annotated[Path | None, typer.Option(exists=True, dir_okay=False)] = None,
        columns: list[str] | None = None,
        sure: bool = False,
        open_choice: Annotated[bool | None, typer.Option("--open/--shut")] = None,
    ) -> None:
        GIVEN.append(dict(locals()))

    @app.command()
    def other() -> None: ...  # pyright: ignore[reportUnusedFunction] -- with one command there is no group

    return app


def said_by(group: type[TyperGroup], words: Sequence[str]) -> tuple[list[Any], str]:
    """Return the values that reach the command, or the error if it refuses."""
    GIVEN.clear()
    command = typer.main.get_command(taking(group))
    try:
        TyperGroup.main(command, ["take", *words], standalone_mode=False)  # pyright: ignore[reportArgumentType]
    except Exception as error:
        return [], str(getattr(error, "message", error))
    return [{name: (type(value), value) for name, value in one.items()} for one in GIVEN], ""


@pytest.mark.parametrize(
    "words",
    [
        ["a.csv"],
        ["a.csv", "b/c.csv", "--name", "flow", "--rig", "r.toml", "--columns", "a=b", "--columns", "c", "--sure"],
        ["a.csv", "--count", "3", "--rate", "2e3", "--whole", "4", "--open"],
        ["a.csv", "--rate", "inf", "--shut"],
        ["a.csv", "--there", "FOLDER"],
        ["a.csv", "--there", "FOLDER/none.csv"],
        ["a.csv", "--there", "FOLDER/here.csv"],
        ["FOLDER/here.csv", ""],
        [],
    ],
)
def test_a_command_gets_the_same_values_as_from_typer(tmp_path: Path, words: Sequence[str]) -> None:
    (tmp_path / "here.csv").write_text("1")
    put = [word.replace("FOLDER", str(tmp_path)) for word in words]
    assert said_by(HydrostateGroup, put) == said_by(TyperGroup, put)


def test_parameters_of_an_unknown_typer_version_are_left_unchanged(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "typer._coercion", None)
    command = typer.main.get_command(taking(TyperGroup))
    accept_plain_values(command.params)
    assert all(one._runtime_param is None for one in command.params)  # pyright: ignore


@pytest.mark.parametrize(
    ("option", "text", "said"),
    [
        ("--count", "x", "a whole number is needed, got 'x'"),
        ("--rate", "10s", "a number is needed, got '10s'"),
        ("--count", "6", "must be less than or equal to 5, got '6'"),
    ],
)
def test_an_invalid_value_is_quoted_in_the_error(option: str, text: str, said: str) -> None:
    assert said_by(HydrostateGroup, ["a.csv", option, text]) == ([], said)
