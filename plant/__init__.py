"""Physics, parameters, signals, sensors, and `Record`, the run or log that every layer shares."""
