"""The gear-pump actuator as the command line knows it: its options, entries of the JSON contract, words and pages."""
