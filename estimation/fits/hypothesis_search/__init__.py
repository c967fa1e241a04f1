"""Search for the hypotheses about rig, oil and logger that explain a log, and weigh them by likelihood."""
