"""Output-error fits of grey-box models: a log, kernels that predict it, the problem, its descent, and what is left."""
