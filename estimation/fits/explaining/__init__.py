"""What may be strange about a rig, its oil or its logger: which hypotheses explain a log, and how they are weighed."""
