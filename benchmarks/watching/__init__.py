"""Streams and trends: alarms of a watch, slow growth, forecasts, rows through a broker."""
