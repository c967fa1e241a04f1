"""Compiles readable scalar models to generated kernels.

A model is a plain Python function of scalars. Traced once with symbols, it becomes a graph of arithmetic
(`expression`), is differentiated there, and is written to the text of a kernel (`source`, `paste`). A small compiler
turns the text into machine code (`native`), which is cached across processes. The same function runs on floats and
arrays through `functions`.
"""
