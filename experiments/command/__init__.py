"""What the verbs of the command `hydrostate` share: options, output, and what happens to each of several logs."""
