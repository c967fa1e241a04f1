"""A server in its own process, for benchmarks and tests: started, queried, measured, killed."""

import json
import os
import signal
import subprocess
import sys
import time
from http.client import HTTPConnection
from pathlib import Path
from types import TracebackType
from typing import Any, Self
from urllib.parse import quote, urlsplit

START_TIMEOUT = 60.0
"""Time limit for a server to start listening [s]."""


class Server:
    """`hydrostate serve FOLDER` on a free port.

    Parameters
    ----------
    folder : Path
        Folder for its data.
    *options : str
        Additional options of the command line.
    """

    def __init__(self, folder: Path, *options: str) -> None:
        command = [sys.executable, "-m", "experiments.cli", "serve", str(folder), "--port", "0", *options]
        self.process = subprocess.Popen(command, stdout=subprocess.PIPE, text=True)  # noqa: S603 -- our own command
        said = (self.process.stdout.readline() if self.process.stdout else "").strip()
        if not said.startswith("http://"):
            raise RuntimeError(f"the server did not start: {said!r}, code {self.process.wait(START_TIMEOUT)}")
        parts = urlsplit(said)
        self.base = f"http://{parts.netloc}"
        self.host, self.port = parts.hostname or "", parts.port or 0

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        if self.process.poll() is None:
            self.process.send_signal(signal.SIGINT)
            try:
                self.process.wait(20.0)
            except subprocess.TimeoutExpired:
                self.kill()
        if self.process.stdout is not None:
            self.process.stdout.close()

    def kill(self) -> None:
        """End it abruptly, as a power cut would."""
        self.process.kill()
        self.process.wait()

    def ask(self, method: str, path: str, body: bytes | None = None) -> tuple[int, bytes]:
        """Return status and body of an answer."""
        connection = HTTPConnection(self.host, self.port, timeout=60.0)
        try:
            connection.request(method, path, body)
            answer = connection.getresponse()
            return answer.status, answer.read()
        finally:
            connection.close()

    def json(self, path: str) -> Any:
        """Return the JSON answer of a path."""
        status, body = self.ask("GET", path)
        if status != 200:
            raise RuntimeError(f"{path}: {status} {body[:200]!r}")
        return json.loads(body)

    def upload_log(self, name: str, content: bytes, verb: str = "estimate") -> str:
        """Upload a log, retrying while the server is busy; return its identity."""
        while True:
            status, body = self.ask("POST", f"/api/logs?name={quote(name)}&verb={verb}", content)
            if status == 202:
                return str(json.loads(body)["id"])
            if status != 429:
                raise RuntimeError(f"{name}: {status} {body[:200]!r}")
            time.sleep(0.5)

    def finished(self, identity: str, seconds: float = 120.0) -> Any:
        """Return a log once its processing is over."""
        until = time.monotonic() + seconds
        while time.monotonic() < until:
            log = self.json(f"/api/logs/{identity}")
            if log["state"] not in ("waiting", "running"):
                return log
            time.sleep(0.1)
        raise TimeoutError(f"the work on {identity} is not over after {seconds:g} s")

    def memory(self) -> int:
        """Return the memory of the answering process [bytes]."""
        pages = int(Path(f"/proc/{self.process.pid}/statm").read_text().split()[1])
        return pages * os.sysconf("SC_PAGE_SIZE")

    def cpu(self) -> float:
        """Return the processor time of the server and its processes so far [s]."""
        return sum(_cpu_of(pid) for pid in [self.process.pid, *_children(self.process.pid)])


def _children(pid: int) -> list[int]:
    return [int(one) for one in Path(f"/proc/{pid}/task/{pid}/children").read_text().split()] + [
        int(child)
        for task in Path(f"/proc/{pid}/task").iterdir()
        if task.name != str(pid)
        for child in (task / "children").read_text().split()
    ]


def _cpu_of(pid: int) -> float:
    fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")
