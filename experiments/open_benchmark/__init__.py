"""The open benchmark: logs with their truth, from physics that no estimator of this project uses, and their scores."""
