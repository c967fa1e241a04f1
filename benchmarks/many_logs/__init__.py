"""Many logs and long studies: archives, fleets, batches, and start-up time of a verb."""
