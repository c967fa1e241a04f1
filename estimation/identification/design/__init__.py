"""Test signals for identification, dead time, and detection of sticking."""
