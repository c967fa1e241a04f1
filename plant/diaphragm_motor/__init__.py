"""The seven-chamber piezo diaphragm motor: parameters, flow, plate, run."""
