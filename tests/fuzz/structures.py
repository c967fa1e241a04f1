"""Mutations that use a file's structure: its parts, compression, encoding and name."""

import gzip
import io
import re
import zipfile
import zlib
from collections.abc import Callable, Mapping, Sequence
from typing import Any

from tests.fuzz.blocks import BINARY, Generator, anywhere, blank, cut, doubled, exchanged, lost, rained
from tests.fuzz.mutations import CELLS

HOSTILE_XML: Sequence[bytes] = (
    *(
        b"<row>",
        b"</row>",
        b'<c r="ZZZZZZ999999999"><v>1</v></c>',
        b'<c r="A0"><v>1</v></c>',
        b'<c t="s"><v>99999</v></c>',
    ),
    *(
        b'<c t="s"><v>-1</v></c>',
        b'<c t="d"><v>x</v></c>',
        b'<c t="e"><v>#REF!</v></c>',
        b'<c t="b"><v>7</v></c>',
        b"&x;",
    ),
    *(
        b"<!DOCTYPE a [<!ENTITY x 'y'>]>",
        b"<v>1e999</v>",
        b"<v>nan</v>",
        b'<dimension ref="A1:XFD1048576"/>',
        b"\xff\xfe",
    ),
    *(b'r="9999999999"', b'<mergeCell ref="A1:XFD9"/>', b'xmlns:q="urn:q"', b"]]>", b"<!--", b'<f>SUM("</f>', b"&#0;"),
)
HOSTILE_JSON: Sequence[bytes] = (
    *(
        b"[" * 5000,
        b'{"a":' * 3000,
        b"1e999",
        b"-",
        b"NaN",
        b"Infinity",
        b'"\\ud800"',
        b"null",
        b"[]",
        b"{}",
        b'"time_s":[]',
    ),
    *(
        b"1" * 5000,
        b'{"time_s":1,"time_s":2}',
        b"\\",
        b"true",
        b",",
        b"]",
        b"\xef\xbb\xbf",
        b"0x1",
        b"1_0",
        b"//",
        b"[null]",
    ),
)


def encoded_otherwise(data: bytes, rng: Generator) -> bytes:
    """Return a text in another encoding, from the start or from some place on."""
    text, names = (
        data.decode(errors="replace"),
        ("utf-16", "utf-16-be", "utf-32", "utf-7", "cp037", "shift_jis", "cp1252"),
    )
    at, how = int(rng.integers(len(text) + 1)) * int(rng.random() < 0.5), str(rng.choice(names))
    return text[:at].encode() + text[at:].encode(how, errors="replace")


def ends_mixed(data: bytes, rng: Generator) -> bytes:
    """Return a text with two other kinds of line ends, mixed."""
    ends = (b"\n", b"\r\n", b"\r", b"\n\n", b"\n\r", b"\x85", b"\x0b", b"\0\n", b"\xe2\x80\xa8")
    some = [ends[int(rng.integers(len(ends)))] for _ in range(2)]
    return b"".join(line + some[int(rng.random() < 0.2)] for line in data.split(b"\n"))


def cells_spoilt(data: bytes, rng: Generator) -> bytes:
    """Return a text with a column, or some of its cells, replaced."""
    lines = data.split(b"\n")
    by = max((b",", b";", b"\t"), key=data.count)
    column, piece = int(rng.integers(5)), CELLS[int(rng.integers(len(CELLS)))]
    share = float(rng.choice((1.0, 0.3, 0.02)))
    for row, line in enumerate(lines):
        cells = line.split(by)
        if len(cells) > column and rng.random() < share:
            cells[column] = piece
            lines[row] = by.join(cells)
    return b"\n".join(lines)


def stretched(data: bytes, rng: Generator) -> bytes:
    """Return a text with a very long row, name or number."""
    lines = data.split(b"\n")
    at = int(rng.integers(min(len(lines), 4)))
    long = (b"9" * 200_000, b"," * 100_000, b'"' * 50_001, b"a;" * 100_000, b" " * 300_000, b"-" * 70_000)
    lines[at] += long[int(rng.integers(len(long)))]
    return b"\n".join(lines)


TEXT = (
    encoded_otherwise,
    ends_mixed,
    cells_spoilt,
    cells_spoilt,
    stretched,
    cut,
    doubled,
    exchanged,
    lost,
    blank,
    rained,
)


def with_pieces(pieces: Sequence[bytes]) -> Callable[[bytes, Generator], bytes]:
    """Return a mutation that inserts such pieces at marks of the markup."""

    def put(data: bytes, rng: Generator) -> bytes:
        for _ in range(int(rng.integers(1, 4))):
            places = [one.start() for one in re.finditer(rb"[<>\[\]{},:\"]", data)] or [0]
            at = int(rng.choice(places))
            drop = int(rng.choice((0, 0, 1, 30)))
            data = data[:at] + pieces[int(rng.integers(len(pieces)))] + data[at + drop :]
        return data

    return put


def _one_of(some: Sequence[Callable[[bytes, Generator], bytes]], data: bytes, rng: Generator) -> bytes:
    return some[int(rng.integers(len(some)))](data, rng)


def in_zip(data: bytes, rng: Generator) -> bytes:
    """Return an archive in which one member is mutated, missing, duplicated or renamed."""
    made = io.BytesIO()
    with zipfile.ZipFile(io.BytesIO(data)) as old, zipfile.ZipFile(made, "w", zipfile.ZIP_DEFLATED) as new:
        names = old.namelist()
        struck = (
            str(rng.choice(names)) if rng.random() < 0.4 else max(names, key=lambda one: old.getinfo(one).file_size)
        )
        for name in names:
            held = old.read(name)
            if name == struck:
                kinds = (with_pieces(HOSTILE_XML), with_pieces(HOSTILE_XML), cut, lost, doubled, anywhere)
                held = _one_of(kinds if name.endswith((".xml", ".rels")) else BINARY, held, rng)
                if rng.random() < 0.1:
                    continue
                if rng.random() < 0.1:
                    new.writestr(f"../{name}" if rng.random() < 0.5 else name.upper(), held)
            new.writestr(name, held)
    return made.getvalue()


def in_gzip(data: bytes, rng: Generator) -> bytes:
    """Return a compressed text that is mutated, compressed again, written twice, or followed by something else."""
    text = gzip.decompress(data)
    match int(rng.integers(6)):
        case 0:
            return gzip.compress(gzip.compress(text))
        case 1:
            return data + data
        case 2:
            return data + b"\0" * 100 + rng.bytes(20)
        case 3:
            return gzip.compress(b"0," * int(rng.choice((10**5, 3 * 10**7))))
        case _:
            return gzip.compress(_one_of(TEXT, text, rng))


def in_mat(data: bytes, rng: Generator) -> bytes:
    """Return a MAT 5 file whose elements are mutated and then compressed."""
    return data[:128] + _packed_element(_one_of(BINARY, data[128:], rng))


def _packed_element(content: bytes) -> bytes:
    packed = zlib.compress(content)
    return (15).to_bytes(4, "little") + len(packed).to_bytes(4, "little") + packed


def in_zstd(data: bytes, rng: Generator) -> bytes:
    """Return a text that is mutated and then compressed with zstd."""
    import pyarrow as pa

    with pa.CompressedInputStream(io.BytesIO(data), "zstd") as file:
        text = _one_of(TEXT, bytes(file.read()), rng)
    made = pa.BufferOutputStream()
    with pa.CompressedOutputStream(made, "zstd") as out:
        out.write(text)
    return made.getvalue().to_pybytes()


INSIDE: Mapping[str, Callable[[bytes, Generator], bytes]] = {
    ".xlsx": in_zip,
    ".npz": in_zip,
    ".gz": in_gzip,
    ".zst": in_zstd,
    ".mat": in_mat,
    ".json": with_pieces(HOSTILE_JSON),
    ".jsonl": with_pieces(HOSTILE_JSON),
}
"""Mutations of a file's content behind its compression or markup, by suffix."""

TEXTS = (".csv", ".txt", ".tsv", ".lvm", ".dat", ".asc", ".json", ".jsonl", ".ndjson")
SUFFIXES = (
    ".csv",
    ".xlsx",
    ".mat",
    ".parquet",
    ".feather",
    ".tdms",
    ".h5",
    ".mf4",
    ".npz",
    ".npy",
    ".json",
    ".gz",
    ".zst",
)
NAMES: Sequence[str] = (
    *(
        "-o.csv",
        "--help.csv",
        "a\nb.csv",
        "a'b\"c.csv",
        "=1+1.csv",
        "a b.csv",
        "ü€\u202e.csv",
        "[x].csv",
        "*.csv",
        "{a}.csv",
    ),
    *(
        "%s.csv",
        "a;b.csv",
        "$(x).csv",
        ".csv",
        "x" * 250 + ".csv",
        "CON.csv",
        "\x1b[31m.csv",
        "#.csv",
        "a%20b.csv",
        "log",
    ),
)


def struck(name: str, content: bytes, others: Mapping[str, tuple[str, bytes]], rng: Generator) -> tuple[str, bytes]:
    """Return a file's name and content after one or two of these mutations.

    Parameters
    ----------
    name : str
        Name of the file, whose suffix gives its kind.
    content : bytes
        Its content.
    others : Mapping[str, (str, bytes)]
        Files of other kinds, which may be appended to it.
    rng : numpy.random.Generator
        Source of the random choices.
    """
    suffix = "." + name.rsplit(".", 1)[-1]
    inside: Any = INSIDE.get(suffix)
    for _ in range(1 + int(rng.random() < 0.2)):
        try:
            if inside is not None and rng.random() < 0.6:
                content = inside(content, rng)
            else:
                content = _one_of(TEXT if suffix in TEXTS else BINARY, content, rng)
        except (zipfile.BadZipFile, OSError, EOFError, zlib.error, RuntimeError, NotImplementedError, ValueError):
            content = anywhere(content, rng)
    if rng.random() < 0.05:
        content = content + others[str(rng.choice(list(others)))][1]
    if rng.random() < 0.06:
        name = f"log{rng.choice(SUFFIXES)}"
    if rng.random() < 0.05:
        name = str(rng.choice(NAMES))
    return name, content
