"""State-space models of several inputs and outputs: subspace start, output-error fit, covariance."""
