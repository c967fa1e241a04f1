"""Steps and runs of any plant: fixed-step, adaptive, and a reference."""
