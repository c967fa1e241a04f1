"""The gear-pump actuator on the command line: its options, entries of the JSON contract, words and pages."""
