"""Shared parts of the verbs of `hydrostate`: options, output, and the treatment of several logs."""
