"""Output-error fits of grey-box models: log, compiled prediction, least-squares problem, descent, residual tests."""
