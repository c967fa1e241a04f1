"""How severities of one actuator develop from log to log, and when a limit is crossed."""
