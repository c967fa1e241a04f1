import re
import shlex
import subprocess
import sys
from pathlib import Path

import pytest

README = Path(__file__).parent.parent / "README.md"
COMMAND = Path(sys.executable).parent / "hydrostate"


def readme_commands() -> list[list[str]]:
    blocks = re.findall(r"```sh\n(.*?)```", README.read_text(encoding="utf-8"), flags=re.DOTALL)
    lines = [line.split("#")[0].strip() for block in blocks for line in block.splitlines()]
    return [shlex.split(line)[1:] for line in lines if line.startswith("hydrostate ")]


def test_the_readme_shows_every_verb_that_works_on_logs() -> None:
    assert {"simulate", "estimate", "identify", "diagnose"} <= {words[0] for words in readme_commands()}


@pytest.fixture(scope="module")
def done(tmp_path_factory: pytest.TempPathFactory) -> list[subprocess.CompletedProcess[str]]:
    """Run the README's commands in order, in one folder."""
    folder = tmp_path_factory.mktemp("readme")
    return [
        subprocess.run([COMMAND, *words], cwd=folder, capture_output=True, text=True, check=False)  # noqa: S603 - the README's own commands
        for words in readme_commands()
    ]


def test_every_command_of_the_readme_runs_as_printed_and_in_order(done: list[subprocess.CompletedProcess[str]]) -> None:
    for words, one in zip(readme_commands(), done, strict=True):
        assert one.returncode == 0, f"hydrostate {' '.join(words)}: {one.stderr}"


def test_the_readmes_script_runs_as_printed(tmp_path: Path) -> None:
    (script,) = re.findall(r"```python\n(.*?)```", README.read_text(encoding="utf-8"), flags=re.DOTALL)
    done = subprocess.run(  # noqa: S603 - our own interpreter on the README's own lines
        [sys.executable, "-c", f"import sys; sys.path.insert(0, {str(README.parent)!r})\n{script}"],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    assert "minor_leakage" in done.stdout
    assert "TransferFunction" in done.stdout or "z^2" in done.stdout


def test_the_readme_quotes_what_estimate_prints(done: list[subprocess.CompletedProcess[str]]) -> None:
    quoted = re.search(r"```text\n(.*?)\n```", README.read_text(encoding="utf-8"), flags=re.DOTALL)
    assert quoted is not None
    assert readme_commands()[1][0] == "estimate"
    assert quoted.group(1) in done[1].stdout + done[1].stderr


@pytest.mark.parametrize("link", sorted(set(re.findall(r"\]\(([\w/.-]+)\)", README.read_text(encoding="utf-8")))))
def test_every_link_of_the_readme_leads_somewhere(link: str) -> None:
    assert (README.parent / link).exists()
