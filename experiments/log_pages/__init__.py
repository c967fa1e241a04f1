"""Pages, figures and words about one log."""
