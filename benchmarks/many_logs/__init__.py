"""Many logs and long studies: archives, fleets, batches, and how long a verb takes to start."""
