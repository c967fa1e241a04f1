"""The server: logs are uploaded, processed in processes that can be killed, and stored; streams are watched."""
