"""A small compiler for kernels: plain typed Python to machine code, by LLVM, in a fraction of a second.

A kernel's text (`program`) is functions, constants, and operations made of straight lines (`lines`, `operations`).
What its functions may hold is in `statements`, `expressions`, `calls` and `arrays`: whole and real numbers, truths,
complex numbers, arrays of them, tuples, slices, ranges; branches and loops; `math` and a little of NumPy. Everything
else is refused by its line. Each call is compiled for the kinds of what it is given (`kinds`, `scope`), so nothing
needs an annotation.

`machine` makes machine code of LLVM's intermediate representation, `store` keeps it, `entry` is what Python calls,
with what `signature` reads off the documentation. `load` puts them together; `loops` does so for functions of a
module.

Two departures from Python: a negative index counts from the end where it is a literal, and nowhere else; a whole
number divided by zero gives zero.
"""
