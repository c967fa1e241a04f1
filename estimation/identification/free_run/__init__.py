"""Models of any channels, with offset, chosen and judged by their free run on data held back."""
