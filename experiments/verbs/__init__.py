"""The verbs of the command `hydrostate` that are not studies, one per file; a study's verb is in its own folder."""
