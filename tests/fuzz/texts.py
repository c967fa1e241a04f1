"""Mutated rig files, study files, ``--columns`` texts and streams: accepted, or refused in one sentence.

Run it as ``python -m tests.fuzz.texts 2000 500``, with the numbers of texts and of streams.
"""

import json
import sys
import tempfile
import time
from collections.abc import Callable
from importlib.resources import files
from pathlib import Path

import numpy as np

from experiments.batch.cases import plan_study
from experiments.batch.study_file import read_study
from experiments.command.options import load_columns
from plant.eha.rig import read_rig, rig_template
from plant.errors import HydrostateError
from plant.log.columns import resolve_columns
from tests.fuzz.guard import limited
from tests.fuzz.mutations import CELLS, mutated
from tests.fuzz.structures import TEXT

TOML = tuple(
    one.encode()
    for one in (
        *("nan", "inf", "-inf", "1e308", "-1e-320", "true", "[]", "{}", '""', "[[runs]]", "[parameters]", "=", "1e999"),
        *("1979-05-27", '"../up"', '"\\u001b[2J"', '"m*9**9**9"', '"POS:m±1"', "9" * 400, "[" * 200, '"""', "'", "#"),
        *(
            "name = 1\n",
            "seeds = 99999999999999\n",
            "seeds = 99999999\n",
            "seeds = -1\n",
            "sample_time = 0.0\n",
            "duration = 1e300\n",
            "\0",
        ),
        *(
            "name = 'a'\nname = 'b'\n",
            "9223372036854775808",
            "0x" + "f" * 300,
            "1e-400",
            "+nan",
            "1_0",
            "d\u03bfuration = 1.0\n",
            "\uff4e\uff41\uff4d\uff45 = 1\n",
            "\u202e",
            "\u2212" + "1.0",
            "a.b.c = 1\n",
            "{a = {b = {c = 1}}}",
            "[[runs]]\n" * 300,
            "[runs]\n",
            "[" * 3000 + "]" * 3000,
            "0,5",
            "1979-05-27T07:32:00Z",
            '"\\uD800"',
            "'" * 3,
            "\r",
        ),
    )
)
COLUMNS = b"time_s=T:ms,position_m=POS, MM:mm,motor_speed_rad_s=Motor speed [rpm]:U/min,velocity_m_s=V"
ROWS = "time_s,motor_speed_rad_s,position_m,velocity_m_s\n" + "".join(
    f"{0.01 * k:.2f},{k % 9},{0.001 * (k % 5):.3f},0.1\n" for k in range(200)
)


def read_toml(content: bytes, path: Path) -> None:
    """Read a text as a rig or else as a study; plan the study if it is small."""
    path.write_bytes(content)
    try:
        read_rig(path)
    except HydrostateError:
        study = read_study(path)
        if sum(len(one.seed_list) for one in study.runs) < 1000:
            plan_study(study, path.parent)


def read_columns(content: bytes, _: Path) -> None:
    """Parse the option, and look up its columns."""
    text = content.decode(errors="replace")
    resolve_columns(["T", "POS, MM", "Motor speed [rpm]", "V"], load_columns([text]), "a.csv")


def watch_stream(content: bytes, _: Path) -> None:
    """Watch a stream; its last line must be JSON that states how it ended."""
    from typer.testing import CliRunner

    from experiments.cli import app

    done = CliRunner().invoke(app, ["watch", "-"], input=content)
    if "an internal error" in done.output or "Traceback" in done.output:
        raise AssertionError(done.stderr[-300:])
    lines = [json.loads(line) for line in done.stdout.splitlines()]
    if not lines or lines[-1]["event"] != "end" or done.exit_code != (0 if lines[-1]["outcome"] == "ok" else 2):
        raise AssertionError(f"exit code {done.exit_code}, {done.stdout[-200:]!r}")


def run(texts: int, streams: int, first: int = 0) -> list[str]:
    """Mutate a number of texts and streams, and return the failures with kind and seed."""
    study = files("experiments.batch").joinpath("studies/eha-paper.toml").read_bytes()
    kinds: list[tuple[str, bytes, Callable[[bytes, Path], None]]] = [
        ("rig", rig_template().encode(), read_toml),
        ("study", study, read_toml),
        ("columns", COLUMNS, read_columns),
    ]
    wrong: list[str] = []
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "text.toml"
        watch_stream(ROWS.encode(), path)  # compiles the kernel here, so that no single stream has to
        cases = [(seed, *kinds[seed % 3]) for seed in range(first, first + texts)]
        cases += [(seed, "stream", ROWS.encode(), watch_stream) for seed in range(first, first + streams)]
        for seed, kind, content, use in cases:
            pieces = CELLS if kind in ("columns", "stream") else TOML
            rng = np.random.default_rng(seed)
            made = mutated(content, rng, pieces)
            if rng.random() < 0.4:
                made = TEXT[int(rng.integers(len(TEXT)))](made, rng)
            said = limited(lambda made=made, use=use: use(made, path))
            if said:
                wrong.append(f"{kind}, seed {seed}: {said}")
    return wrong


if __name__ == "__main__":
    begun = time.monotonic()
    found = run(int(sys.argv[1]), int(sys.argv[2]), int(sys.argv[3]) if len(sys.argv) > 3 else 0)
    sys.stdout.write("\n".join([*found, f"{len(found)} wrong, {time.monotonic() - begun:.0f} s\n"]))
    sys.exit(bool(found))
