"""The verbs of the command `hydrostate` that are no study, one a file; a study has its verb in its own folder."""
