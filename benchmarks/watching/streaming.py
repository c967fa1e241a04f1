"""Rows at 10 kHz through a real broker into a watch, for ten minutes: losses, delay, and cost.

The publisher is a process of its own and sends batches of a tenth of a second, on time. The broker buffers any number,
so any loss would occur here.
"""

import argparse
import multiprocessing
import shutil
import socket
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

from faults.watch.watch import Watch
from plant.eha.model import EhaParameters
from plant.log.stream.csv_rows import CsvStream
from plant.log.stream.source import BatchCounts, batch, stream_lines

RATE, ROWS = 10_000, 1000
TOPIC = "bench/rows"
HEADER = "time_s,motor_speed_rad_s,position_m,differential_pressure_pa"


def publish(port: int, seconds: float) -> None:
    """Send rows on time, then the end."""
    from paho.mqtt import client as mqtt
    from paho.mqtt.enums import CallbackAPIVersion

    client = mqtt.Client(CallbackAPIVersion.VERSION2)
    client.max_inflight_messages_set(1000)
    client.connect("127.0.0.1", port)
    client.loop_start()
    time.sleep(2.0)
    rng, begin = np.random.default_rng(0), time.monotonic()
    for number in range(round(seconds * RATE / ROWS)):
        moments = (number * ROWS + np.arange(ROWS)) / RATE
        speed = 125.0 * np.sign(np.sin(2.0 * np.pi * 2.0 * moments))
        position = 1e-2 * np.sin(2.0 * np.pi * 2.0 * moments) + 1e-6 * rng.standard_normal(ROWS)
        pressure = 3e3 * speed + 5e3 * rng.standard_normal(ROWS)
        rows = [
            f"{t:.4f},{u:.3f},{x:.8f},{p:.0f}" for t, u, x, p in zip(moments, speed, position, pressure, strict=True)
        ]
        time.sleep(max(0.0, begin + (number + 1) * ROWS / RATE - time.monotonic()))
        client.publish(TOPIC, batch(number, HEADER, rows), qos=1)
    client.publish(TOPIC, "", qos=1).wait_for_publish(60.0)
    client.loop_stop()


def main(arguments: list[str]) -> int:
    """Print what arrived; return 1 if a row is missing."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seconds", type=float, default=600.0)
    seconds = parser.parse_args(arguments).seconds
    program = shutil.which("mosquitto") or shutil.which("mosquitto", path="/usr/sbin")
    if program is None:
        print("mosquitto is not installed: not measured", file=sys.stderr)
        return 0
    with socket.socket() as one:
        one.bind(("127.0.0.1", 0))
        port: int = one.getsockname()[1]
    with tempfile.TemporaryDirectory() as folder:
        settings = Path(folder) / "mosquitto.conf"
        settings.write_text(f"listener {port} 127.0.0.1\nallow_anonymous true\nmax_queued_messages 0\n")
        with subprocess.Popen([program, "-c", str(settings)], stderr=subprocess.DEVNULL) as broker:  # noqa: S603
            time.sleep(1.0)
            sender = multiprocessing.Process(target=publish, args=(port, seconds), daemon=True)
            sender.start()
            received = BatchCounts()
            stream = CsvStream(stream_lines(f"mqtt://127.0.0.1:{port}/{TOPIC}", received), source="broker")
            watch = Watch(EhaParameters(), stream.sample_time)
            begin, busy, count, missing, late = time.monotonic(), time.process_time(), 0, 0, list[float]()
            for last, rows, _ in stream.samples(watch.block):
                watch.take(rows)
                count, missing = count + len(rows), missing + int(np.sum(np.isnan(rows[:, 0])))
                late.append(time.monotonic() - begin - last)
            wall, busy = time.monotonic() - begin, time.process_time() - busy
            broker.terminate()
    wanted = round(seconds * RATE)
    delay = np.array(late) - np.min(late)
    print(f"{count - missing} of {wanted} rows in {wall:.0f} s; {received}")
    print(f"behind the quickest: median {np.median(delay):.3f} s, worst {np.max(delay):.3f} s; CPU {busy / wall:.0%}")
    return int(count - missing != wanted)
