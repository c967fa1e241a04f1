"""Readable scalar models in, generated kernels out.

A model is a plain Python function of scalars. Traced once with symbols, it becomes a graph of arithmetic
(`expression`), is differentiated there, and is written to the text of a kernel (`source`, `paste`). A small compiler
makes machine code of it (`native`), which is cached across processes. The same function runs on floats and arrays
through `functions`.
"""
