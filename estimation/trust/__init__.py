"""Whether an estimate can be believed: bounds, consistency, whiteness, identifiability."""
