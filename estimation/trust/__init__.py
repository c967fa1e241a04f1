"""May the number be believed: bounds, consistency, whiteness, identifiability."""
