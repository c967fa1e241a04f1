"""The page renderer, the figure style, and the result folder, shared by all."""
