"""Trials of a server: hostile clients, a kill during uploads, a fast stream."""

import socket
import threading
import time
from collections.abc import Iterator, Mapping
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.server.hostile_client import MIX, HostileClients
from benchmarks.server.server_process import Server
from plant.eha.drives import make_drive
from plant.eha.model import EhaParameters
from plant.eha.simulate import LUMPED, simulate
from plant.log.files import write_record
from plant.log.record import Record
from plant.sensors.sensors import BENCH

HEADER = "time_s,motor_speed_rad_s,position_m,differential_pressure_pa\n"

SERVER_LIMITS = ("--largest", "64", "--room", "2048")
"""Limits of a server under attack."""


def reversing_log(seconds: float, sample_time: float, seed: int = 0) -> Record:
    """Return a log of a healthy actuator that reverses at random, with physics simple enough to compute quickly.

    Parameters
    ----------
    seconds : float
        Length of the log [s].
    sample_time : float
        Time between samples [s].
    """
    p, rng = EhaParameters(), np.random.default_rng(seed)
    count = round(seconds / sample_time)
    hold = max(1, round(0.05 / sample_time))
    speed = p.rated_speed * np.repeat(rng.choice((-1.0, 1.0), count // hold + 1), hold)[:count]
    velocity = 0.9 * p.pump_displacement * speed / p.piston_area
    pressure = 1e7 * velocity + 5e3 * rng.standard_normal(count)
    position = np.cumsum(velocity) * sample_time + 1e-6 * rng.standard_normal(count)
    noisy = speed + 0.05 * rng.standard_normal(count)
    return Record(
        sample_time, {"motor_speed_rad_s": noisy, "position_m": position, "differential_pressure_pa": pressure}
    )


def bench_log(path: Path, seconds: float = 4.0) -> bytes:
    """Write a simulated log and return it.

    Parameters
    ----------
    seconds : float
        Length of the log [s].
    """
    healthy, rng = EhaParameters(), np.random.default_rng(3)
    drive = make_drive("prbs", seconds, 1e-3, healthy, rng)
    write_record(simulate(LUMPED, drive, 1e-3, healthy, sensors=BENCH, rng=rng), path)
    return path.read_bytes()


@dataclass(frozen=True)
class AttackResult:
    """The state of a server after an attack.

    Parameters
    ----------
    answers : Mapping[str, int]
        Counts by kind of request and status.
    polite : tuple of int
        Statuses that an honest client got meanwhile, one for each request.
    slowest : float
        Its longest wait for an answer [s].
    memory : tuple of int
        Memory of the answering process: before, and after each quarter of the requests [bytes].
    most : int
        Peak memory of the answering process [bytes].
    strange : tuple of str
        New files outside the server's folder.
    seconds : float
        Duration of the attack [s].
    """

    answers: Mapping[str, int]
    polite: tuple[int, ...]
    slowest: float
    memory: tuple[int, ...]
    most: int
    strange: tuple[str, ...]
    seconds: float


def attack(place: Path, count: int, clients: int, mix: Mapping[str, float] = MIX) -> AttackResult:
    """Attack a new server while an honest client uses it too.

    Parameters
    ----------
    place : Path
        An empty folder that will contain the server's folder.
    count, clients : int
        Number of hostile requests, and number of clients at once.
    """
    polite: list[tuple[int, float]] = []
    heights: list[int] = []
    over = threading.Event()
    with Server(place / "kept", *SERVER_LIMITS) as server:
        hostile = HostileClients(server.host, server.port)
        hostile.attack(count // 20, clients, mix, seed=-1)  # warm-up: buffers and threads exist from here on
        hostile.answers.clear()
        memory, listed = [server.memory()], files_around(place)

        def ask() -> None:
            while not over.is_set():
                began = time.monotonic()
                status, _ = server.ask("GET", "/api/health")
                polite.append((status, time.monotonic() - began))
                heights.append(server.memory())
                over.wait(0.2)

        asking = threading.Thread(target=ask)
        asking.start()
        began = time.monotonic()
        try:
            for quarter in range(4):
                hostile.attack(count // 4, clients, mix, seed=quarter * count)
                memory.append(server.memory())
        finally:
            over.set()
            asking.join()
        seconds = time.monotonic() - began
        strange = tuple(sorted(files_around(place) - listed))
    statuses = tuple(status for status, _ in polite)
    slowest = max((waited for _, waited in polite), default=0.0)
    return AttackResult(dict(hostile.answers), statuses, slowest, tuple(memory), max(heights), strange, seconds)


def files_around(place: Path) -> set[str]:
    """Return the files in places a log could have escaped to: beside the server's folder, above it, and in /tmp."""
    found = {str(one) for one in place.rglob("*") if place / "kept" not in one.parents}
    above = [*place.parents[:2], Path("/tmp"), Path.cwd()]  # noqa: S108 -- looked at, not written
    return found | {str(one) for folder in above for one in folder.iterdir() if "escaped" in one.name}


@dataclass(frozen=True)
class KillResult:
    """State of a server before and after it was killed.

    Parameters
    ----------
    accepted, finished : int
        Logs that were accepted, and that were finished, at the kill [count].
    lost : tuple of str
        Finished logs whose result or page was changed or gone afterwards.
    unfinished : tuple of str
        Accepted logs that the next server neither finished nor reported as interrupted.
    """

    accepted: int
    finished: int
    lost: tuple[str, ...]
    unfinished: tuple[str, ...]


def kill(place: Path, uploads: int, after: int) -> KillResult:
    """Kill a server during uploads and start it again.

    Parameters
    ----------
    place : Path
        An empty folder.
    uploads : int
        Number of uploaded logs, several at once.
    after : int
        Number of finished logs at which it is killed.
    """
    content = bench_log(place / "run.csv")
    accepted: list[str] = []
    done: dict[str, tuple[Any, bytes]] = {}

    def drop(number: int) -> None:
        time.sleep(0.3)
        try:
            accepted.append(server.upload_log(f"run{number}.csv", content))
        except (OSError, RuntimeError):  # the server was killed meanwhile
            return

    with Server(place / "kept") as server, ThreadPoolExecutor(2) as pool:
        dropping = [pool.submit(drop, number) for number in range(uploads)]
        while len(done) < after:
            for identity in [one for one in accepted if one not in done]:
                if server.json(f"/api/logs/{identity}")["state"] == "done":
                    done[identity] = result_of(server, identity)
            time.sleep(0.02)
        server.kill()
        for one in dropping:
            one.result()
    with Server(place / "kept") as server:
        lost = [one for one, before in done.items() if result_of(server, one) != before]
        left: list[str] = []
        for identity in accepted:
            try:
                state = server.finished(identity)["state"]
            except (TimeoutError, RuntimeError):
                state = "lost"
            if state not in ("done", "interrupted"):
                left.append(identity)
    return KillResult(len(accepted), len(done), tuple(lost), tuple(left))


def result_of(server: Server, identity: str) -> tuple[Any, bytes]:
    """Return result and page of a log, or the error if there is none."""
    return server.ask("GET", f"/api/logs/{identity}/result"), server.ask("GET", f"/logs/{identity}")[1]


@dataclass(frozen=True)
class StreamResult:
    """Results of a server with a stream.

    Parameters
    ----------
    sent, taken, gaps : int
        Rows sent, rows received, and gaps detected [count].
    share : float
        Processor time of the server and its processes relative to elapsed time [fraction of a core], after the first
        ten seconds.
    behind : float
        Delay from the last row until all were processed [s].
    """

    sent: int
    taken: int
    gaps: int
    share: float
    behind: float


def stream(place: Path, seconds: float, rate: float) -> StreamResult:
    """Send a stream to a server in real time, with a viewer connected.

    Parameters
    ----------
    seconds : float
        Duration [s].
    rate : float
        Rows per second [1/s].
    """
    with send_rows(seconds, rate) as (address, sent), Server(place / "kept", "--watch", f"bench={address}") as server:
        looking = threading.Thread(target=view_events, args=(server,), daemon=True)
        looking.start()
        while not sent.began:
            time.sleep(0.05)
        time.sleep(min(10.0, 0.3 * seconds))
        cpu, began = server.cpu(), time.monotonic()
        while not sent.ended:
            time.sleep(0.2)
        share = (server.cpu() - cpu) / (time.monotonic() - began)
        gauges = last_gauges(server, sent.rows)
        behind = time.monotonic() - sent.ended
        return StreamResult(sent.rows, gauges["rows"], gauges["gaps"], share, behind)


def last_gauges(server: Server, rows: int) -> Any:
    """Return the last gauges once all rows have arrived, or no more arrive."""
    until = time.monotonic() + 20.0
    gauges = server.json("/api/streams/bench")["gauges"]
    while (gauges is None or gauges["rows"] < rows) and time.monotonic() < until:
        time.sleep(0.2)
        gauges = server.json("/api/streams/bench")["gauges"]
    return gauges


def view_events(server: Server) -> None:
    """Read the events of the stream, as a page does."""
    with socket.create_connection((server.host, server.port)) as connection:
        connection.sendall(f"GET /api/streams/bench/events HTTP/1.1\r\nHost: {server.host}\r\n\r\n".encode())
        while connection.recv(1 << 16):
            pass


@dataclass
class SendProgress:
    """Progress of a bench: rows sent, and start and end time [s]."""

    rows: int = 0
    began: float = 0.0
    ended: float = 0.0


@contextmanager
def send_rows(seconds: float, rate: float) -> Iterator[tuple[str, SendProgress]]:
    """Send rows in real time to the first client that connects; yields the address and the progress."""
    record = reversing_log(20.0, 1.0 / rate)
    columns = [record[name] for name in ("motor_speed_rad_s", "position_m", "differential_pressure_pa")]
    bodies = [f"{a:.6g},{b:.9g},{c:.7g}\n" for a, b, c in zip(*columns, strict=True)]
    sent = SendProgress()

    def feed(server: socket.socket) -> None:
        connection, _ = server.accept()
        with connection, suppress(OSError):  # the reader may end first
            connection.sendall(HEADER.encode())
            sent.began = time.monotonic()
            while sent.rows < round(seconds * rate):
                due = min(round((time.monotonic() - sent.began) * rate), round(seconds * rate))
                rows = [f"{k / rate:.6f},{bodies[k % len(bodies)]}" for k in range(sent.rows, due)]
                connection.sendall("".join(rows).encode())
                sent.rows = due
                time.sleep(0.02)
            sent.ended = time.monotonic()
            time.sleep(5.0)

    with socket.create_server(("127.0.0.1", 0)) as server:
        threading.Thread(target=feed, args=(server,), daemon=True).start()
        yield f"tcp://127.0.0.1:{server.getsockname()[1]}", sent
