"""Trend of one actuator's severities from log to log, and forecast of when a limit is crossed."""
