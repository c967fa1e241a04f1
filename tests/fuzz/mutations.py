"""Mutations of files and texts, each from a seed, so that a failure can be reproduced."""

from collections.abc import Sequence

import numpy as np

Bytes = bytes
INTERESTING = (0, 1, 0x7F, 0x80, 0xFF, 0xFFFF, 0x7FFFFFFF, 0x80000000, 0xFFFFFFFF, 0xFFFFFFFFFFFFFFFF)
"""Numbers at which counts and offsets often fail."""


def mutated(content: Bytes, rng: np.random.Generator, pieces: Sequence[Bytes] = ()) -> Bytes:
    """Return a file with one to four mutations: flipped bits, changed counts, deleted, repeated or inserted bytes."""
    data = bytearray(content)
    for _ in range(int(rng.integers(1, 5))):
        if not data:
            break
        # header, footer and the whole file are hit equally often
        at = int(
            rng.choice(
                [
                    rng.integers(len(data)),
                    rng.integers(min(600, len(data))),
                    len(data) - 1 - rng.integers(min(600, len(data))),
                ]
            )
        )
        length = int(rng.integers(1, 1 + min(64, len(data))))
        match int(rng.integers(8)):
            case 0:
                data[at] ^= 1 << int(rng.integers(8))
            case 1:
                data[at : at + length] = rng.bytes(length)
            case 2:
                size = int(rng.choice([1, 2, 4, 8]))
                number = INTERESTING[int(rng.integers(len(INTERESTING)))] & (256**size - 1)
                data[at : at + size] = number.to_bytes(size, "little" if rng.random() < 0.5 else "big")
            case 3:
                del data[at : at + length]
            case 4:
                data[at:at] = data[at : at + length]
            case 5:
                del data[at:]
            case 6:
                there = int(rng.integers(len(data)))
                data[at : at + length] = data[there : there + length]
            case _:
                data[at:at] = pieces[int(rng.integers(len(pieces)))] if len(pieces) else b"\0"
    return bytes(data)


CELLS: Sequence[Bytes] = tuple(
    one.encode()
    for one in (
        *(
            "nan",
            "inf",
            "-inf",
            "1e308",
            "-1e308",
            "1e-320",
            "1e999",
            "",
            ",",
            ";",
            "\t",
            '"',
            "\n",
            "\r",
            "\r\n",
            "\0",
        ),
        *(
            "=1+1",
            "\x1b[2J",
            "\ufeff",
            "²",
            "0x10",
            "1_000",
            "1,5",
            "--",
            "[rpm]",
            "(m±1)",
            "m*9**9**9",
            "true_x",
            "time_s",
        ),
        *(
            "2026-03-01 12:00:00",
            "12:00:00",
            "9999-99-99 99:99:99",
            "9" * 400,
            "time_ms,time_s",
            "#",
            "sep=;",
            "position_m",
        ),
    )
)
"""Pieces of text that often trip readers of logs."""
