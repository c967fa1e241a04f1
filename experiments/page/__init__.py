"""One page renderer, one figure style, one result folder."""
