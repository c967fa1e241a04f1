"""The open benchmark: logs with known truth, from a simulator that shares no model with any estimator; their scores."""
