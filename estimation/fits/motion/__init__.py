"""The motion form, fitted to logs without pressure."""
