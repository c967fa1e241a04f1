import queue
import socket
import threading
import time
from typing import Any

import pytest

from plant.errors import HydrostateError, LogError
from plant.log.stream import source as stream_source
from plant.log.stream.source import BatchCounts, batch, broker_of, is_stream, stream_lines

HEADER = "time_s,position_m"


def free_port() -> int:
    with socket.socket() as one:
        one.bind(("127.0.0.1", 0))
        return one.getsockname()[1]


def publish(port: int, topic: str, messages: list[str]) -> None:
    """Publish each message until it has a subscriber: MQTT 5 reports a message that nobody received."""
    from paho.mqtt import client as mqtt
    from paho.mqtt.enums import CallbackAPIVersion

    client: Any = mqtt.Client(CallbackAPIVersion.VERSION2, protocol=mqtt.MQTTv5)
    answers: queue.Queue[str] = queue.Queue()
    client.on_publish = lambda _client, _data, _number, reason, _properties: answers.put(str(reason))
    client.connect("127.0.0.1", port)
    client.loop_start()
    try:
        until = time.monotonic() + 20.0
        for message in messages:
            client.publish(topic, message, qos=1)
            while answers.get(timeout=10.0) == "No matching subscribers":
                assert time.monotonic() < until
                time.sleep(0.02)
                client.publish(topic, message, qos=1)
    finally:
        client.disconnect()  # disconnect first, because the loop notices nothing else for a second
        client.loop_stop()


def through_broker(port: int, topic: str, messages: list[str]) -> tuple[list[str], BatchCounts]:
    received = BatchCounts()
    lines: list[str] = []
    reader = threading.Thread(
        target=lambda: lines.extend(stream_lines(f"mqtt://127.0.0.1:{port}/{topic}", received)), daemon=True
    )
    reader.start()
    publish(port, topic, messages)
    reader.join(20.0)
    assert not reader.is_alive()
    return lines, received


def test_rows_come_through_a_real_broker_in_batches_none_lost(broker: int) -> None:
    rows = [f"{0.1 * i:.1f},{i}" for i in range(1000)]
    messages = [batch(i // 100, HEADER, rows[i : i + 100]) for i in range(0, 1000, 100)]
    lines, received = through_broker(broker, "bench/whole", [*messages, ""])
    assert lines == [f"{line}\n" for line in [HEADER, *rows]]
    assert (received.batches, received.late, received.lost, received.dropped) == (10, 0, 0, 0)


def test_lost_and_late_batches_are_counted_and_left_out(broker: int) -> None:
    messages = [batch(number, HEADER, [f"{number}.0,0"]) for number in (4, 5, 8, 5, 9)]
    lines, received = through_broker(broker, "bench/broken", [*messages, ""])
    assert [line.split(",")[0] for line in lines[1:]] == ["4.0", "5.0", "8.0", "9.0"]
    assert (received.batches, received.late, received.lost) == (4, 1, 2)


def test_a_sender_that_never_ends_its_line_is_refused_before_it_fills_the_memory(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(stream_source, "LONGEST_LINE", 1000)
    with socket.create_server(("127.0.0.1", 0)) as server:
        lines = stream_lines(address := f"tcp://127.0.0.1:{server.getsockname()[1]}", BatchCounts())

        def serve() -> None:
            connection, _ = server.accept()
            with connection:
                connection.sendall(b"time_s\n" + 2000 * b"1")

        sender = threading.Thread(target=serve)
        sender.start()
        assert next(lines) == "time_s\n"
        with pytest.raises(LogError, match="fewer than 1000 characters") as refused:
            next(lines)
        sender.join(10.0)
    assert refused.value.source == address


def test_tcp_keepalive_is_set_to_detect_a_bench_without_power_within_two_minutes(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """A watch used to wait for ever, because nobody had closed the connection."""
    made: list[socket.socket] = []
    connect = socket.create_connection

    def connected(*asked: Any) -> socket.socket:
        made.append(connect(*asked))
        return made[-1]

    monkeypatch.setattr(socket, "create_connection", connected)
    with socket.create_server(("127.0.0.1", 0)) as server:
        lines = stream_lines(f"tcp://127.0.0.1:{server.getsockname()[1]}", BatchCounts())

        def serve() -> None:
            connection, _ = server.accept()
            with connection:
                connection.sendall(b"time_s\n")

        sender = threading.Thread(target=serve)
        sender.start()
        assert next(lines) == "time_s\n"
        sender.join(10.0)
        (one,) = made
        assert one.getsockopt(socket.SOL_SOCKET, socket.SO_KEEPALIVE)
        if hasattr(socket, "TCP_KEEPIDLE"):
            idle, again, most = (
                one.getsockopt(socket.IPPROTO_TCP, getattr(socket, name))
                for name in ("TCP_KEEPIDLE", "TCP_KEEPINTVL", "TCP_KEEPCNT")
            )
            assert idle + again * most <= 120
        lines.close()


def test_rows_of_a_tcp_connection_wait_at_the_sender_until_they_are_read() -> None:
    with socket.create_server(("127.0.0.1", 0)) as server:
        port = server.getsockname()[1]
        sent = [f"{i},{i:01000}" for i in range(28_000)]  # more than the buffers at both ends hold

        def serve() -> None:
            connection, _ = server.accept()
            with connection:
                connection.sendall("".join(f"{line}\n" for line in [HEADER, *sent]).encode())

        sender = threading.Thread(target=serve, daemon=True)
        sender.start()
        lines = stream_lines(f"tcp://127.0.0.1:{port}", BatchCounts())
        assert next(lines) == f"{HEADER}\n"
        sender.join(1.0)
        assert sender.is_alive()
        assert sum(1 for _ in lines) == len(sent)
        sender.join(5.0)
        assert not sender.is_alive()


def test_an_invalid_or_unreachable_stream_address_is_refused() -> None:
    assert is_stream("tcp://here:1")
    assert not is_stream("bench.csv")
    assert is_stream("http://here:1/x")  # an address, but not of a kind that can be read
    for address in ("http://here:1/x", "tcp://here", "tcp://:99", "mqtt://here", "tcp://here:99999999"):
        with pytest.raises(HydrostateError, match="a stream must be tcp://HOST:PORT, mqtt://"):
            stream_lines(address, BatchCounts())
    with pytest.raises(LogError, match="no answer"):
        next(stream_lines(f"tcp://127.0.0.1:{free_port()}", BatchCounts()))


def test_a_message_that_is_no_batch_ends_the_stream_with_an_error(broker: int) -> None:
    received, raised = BatchCounts(), list[LogError]()

    def read() -> None:
        try:
            list(stream_lines(f"mqtt://127.0.0.1:{broker}/bench/other", received))
        except LogError as error:
            raised.append(error)

    reader = threading.Thread(target=read, daemon=True)
    reader.start()
    publish(broker, "bench/other", ["hello"])
    reader.join(10.0)
    assert "a batch must begin with 'rows NUMBER' and a header, got 'hello'" in str(raised[0])


def test_a_publish_address_must_name_one_topic_of_an_mqtt_broker() -> None:
    assert broker_of("mqtt://bench:99/press/events") == ("bench", 99, "press/events")
    for address in ("tcp://bench/press", "mqtt:///press", "mqtt://bench/", "mqtt://bench/a/+/b", "mqtt://bench/a#b"):
        with pytest.raises(HydrostateError, match=r"a topic to publish on must be mqtt://HOST\[:PORT\]/TOPIC"):
            broker_of(address)
