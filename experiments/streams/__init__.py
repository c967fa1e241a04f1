"""Streams: rows as they come, watched or filtered, and where what is told of them goes."""
