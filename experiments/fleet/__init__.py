"""Many logs of many actuators: which are sick, and which are getting worse."""
