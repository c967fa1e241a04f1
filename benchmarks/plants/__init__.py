"""Plants: the circuit and its solvers, the piezo stack, the diaphragm motor."""
