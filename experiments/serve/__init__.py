"""The server: logs are dropped, worked on in processes that can be killed, and kept; streams are watched."""
