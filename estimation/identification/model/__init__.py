"""What an identified model is, and what it says."""
