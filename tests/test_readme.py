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


def test_every_command_of_the_readme_runs_as_printed_and_in_order(tmp_path: Path) -> None:
    for words in readme_commands():
        done = subprocess.run([COMMAND, *words], cwd=tmp_path, capture_output=True, text=True, check=False)  # noqa: S603 - the README's own commands
        assert done.returncode == 0, f"hydrostate {' '.join(words)}: {done.stderr}"


def test_the_readme_quotes_what_estimate_prints(tmp_path: Path) -> None:
    quoted = re.search(r"```text\n(.*?)\n```", README.read_text(encoding="utf-8"), flags=re.DOTALL)
    assert quoted is not None
    simulate, estimate = readme_commands()[:2]
    subprocess.run([COMMAND, *simulate], cwd=tmp_path, capture_output=True, check=True)  # noqa: S603 - as above
    done = subprocess.run([COMMAND, *estimate], cwd=tmp_path, capture_output=True, text=True, check=True)  # noqa: S603 - as above
    assert quoted.group(1) in done.stdout + done.stderr


@pytest.mark.parametrize("link", sorted(set(re.findall(r"\]\(([\w/.-]+)\)", README.read_text(encoding="utf-8")))))
def test_every_link_of_the_readme_leads_somewhere(link: str) -> None:
    assert (README.parent / link).exists()
