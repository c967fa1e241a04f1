"""The open benchmark: logs with their truth, from a simulator that shares no model with any estimator; their scores."""
