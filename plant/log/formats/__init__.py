"""Log files in every format that can be read, and the detection of the format."""
