"""Air, leaks, friction and reeds of the piezo-stack actuator from a log."""
