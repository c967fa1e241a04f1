"""The gear-pump electro-hydrostatic actuator: parameters, three plants, rig file, drives, `simulate`."""
