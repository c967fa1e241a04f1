"""The server under hostile clients, kills and streams."""
