"""A back end for controllers: the graphs and loops that kernels are made of, written as C99 without allocation."""
