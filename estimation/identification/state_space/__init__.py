"""State space of several inputs and outputs: subspace start, output-error end, with covariance."""
