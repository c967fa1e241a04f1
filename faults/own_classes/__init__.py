"""User-defined classes: features of runs, a classifier learnt from labelled runs, verdicts on held-back runs."""
