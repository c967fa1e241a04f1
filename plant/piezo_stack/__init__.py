"""The piezo-stack electro-hydrostatic actuator: parameters, flow, run."""
