"""The contract of a filter, the algebra of predict and update, layouts, and the compiled kernels."""
