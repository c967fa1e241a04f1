"""The flow form, fitted to logs with differential pressure."""
