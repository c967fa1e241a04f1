"""A back end for controllers: the graphs and loops of a kernel, written as C99 without allocation."""
