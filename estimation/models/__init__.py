"""Process models: what a filter or a fit believes of an actuator."""
