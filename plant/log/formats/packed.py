"""Bytes of a log file, compressed or not. Only regular files are read, up to the size of a real log."""

import io
import stat
import zlib
from pathlib import Path
from typing import Any, BinaryIO, cast

from plant.errors import LogError

GZIP, ZSTD = b"\x1f\x8b", b"\x28\xb5\x2f\xfd"

ALWAYS_ALLOWED = 128 << 20
"""Bytes that any packed file may unpack to."""

MOST_EXPANSION = 50
"""Times its own size that a packed file may unpack to, beyond that; logs of benches pack to a third or a tenth."""

_BLOCK = 1 << 18


def require_regular(path: Path) -> None:
    """Refuse a path that is not a regular file, without opening it: a pipe would block.

    Raises
    ------
    LogError
        If there is no such file, or it is a folder, a pipe, a device or a socket.
    """
    try:
        mode = path.stat().st_mode
    except (FileNotFoundError, NotADirectoryError) as error:
        stream = "; a log is read from a file only, a stream by `hydrostate watch -`" if str(path) == "-" else ""
        raise LogError(f"there is no such file{stream}", str(path)) from error
    except ValueError as error:  # the name contains a null character
        raise LogError("there is no such file", repr(str(path))) from error
    if stat.S_ISDIR(mode):
        raise LogError("a file is needed, got a folder; `hydrostate fleet FOLDER` reads all logs of one", str(path))
    if not stat.S_ISREG(mode):
        got = "pipe" if stat.S_ISFIFO(mode) else "socket" if stat.S_ISSOCK(mode) else "device"
        raise LogError(f"a file is needed, got a {got}; a stream is read by `hydrostate watch -`", str(path))


def most_unpacked(size: int) -> int:
    """Return the largest size to which a file may decompress.

    Parameters
    ----------
    size : int
        Its own size [bytes].
    """
    return max(ALWAYS_ALLOWED, MOST_EXPANSION * size)


def too_large(source: str, most: int) -> LogError:
    """Return the error for a file that decompresses to more than a log can hold."""
    return LogError(
        f"it unpacks to more than {most / 2**20:.0f} MB, the most that is read of a packed file of its size "
        f"({ALWAYS_ALLOWED >> 20} MB, or {MOST_EXPANSION} times the file); unpack it first if it is a log",
        source,
    )


class Unpacked(io.RawIOBase):
    """The bytes of a compressed file, up to a limit. Each use opens its own.

    Parameters
    ----------
    file : BinaryIO
        What unpacks.
    most : int
        Bytes after which it is refused.
    """

    def __init__(self, file: BinaryIO, most: int, source: str) -> None:
        super().__init__()
        self._file, self._most, self._source, self._count = file, most, source, 0

    def readable(self) -> bool:
        """Return that the content can be read."""
        return True

    def readinto(self, buffer: Any) -> int:
        """Read some bytes.

        Raises
        ------
        LogError
            If there are more than a log has.
        """
        part = self._file.read(min(len(buffer), _BLOCK))
        self._count += len(part)
        if self._count > self._most:
            raise too_large(self._source, self._most)
        buffer[: len(part)] = part
        return len(part)

    def close(self) -> None:
        """Close the underlying file."""
        self._file.close()
        super().close()


def packing_of(path: Path) -> str | None:
    """Return the compression of a file, ``gzip`` or ``zstd``, by its first bytes; None if it has none."""
    with path.open("rb") as file:
        start = file.read(4)
    return "gzip" if start.startswith(GZIP) else "zstd" if start == ZSTD else None


def open_unpacked(path: Path) -> BinaryIO:
    """Open the decompressed content of a file.

    Returns
    -------
    BinaryIO
        The bytes, unpacked where it is packed.

    Raises
    ------
    OSError
        If it cannot be read.
    """
    packing = packing_of(path)
    if packing is None:
        return path.open("rb")
    if packing == "gzip":
        import gzip

        inner: Any = gzip.open(path, "rb")  # noqa: SIM115 -- closed with what is returned
    else:
        import pyarrow as pa

        inner = pa.input_stream(str(path), compression="zstd")
    raw = Unpacked(inner, most_unpacked(path.stat().st_size), str(path))
    return cast(BinaryIO, io.BufferedReader(raw, _BLOCK))


def inflate(content: "bytes | memoryview", most: int, source: str) -> bytes:
    """Return the decompressed content of zlib data.

    Raises
    ------
    LogError
        If it is more than so many bytes.
    zlib.error
        If it is damaged.
    """
    machine = zlib.decompressobj()
    out = machine.decompress(content, most + 1)
    if len(out) > most:
        raise too_large(source, most)
    if not machine.eof:
        raise zlib.error("it ends too early")
    return out
