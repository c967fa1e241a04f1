"""Classes of a user's own: features of runs, a classifier learnt from labelled runs, verdicts on runs held back."""
