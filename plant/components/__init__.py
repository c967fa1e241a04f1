"""Pure functions, one physical law each, grouped by the part they belong to."""
