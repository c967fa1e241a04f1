"""Streams: rows as they arrive, watched or filtered, and the outputs of their results."""
