"""A small compiler for kernels: plain typed Python to machine code, by LLVM, in a fraction of a second.

A kernel's text (`program`) consists of functions, constants, and operations made of straight lines (`lines`,
`operations`). `statements`, `expressions`, `calls` and `arrays` define what its functions may hold: integers, real
numbers, Booleans, complex numbers, arrays of them, tuples, slices, ranges; branches and loops; `math` and a little of
NumPy. Everything else is refused, with its line number. Each call is compiled for the kinds of its arguments (`kinds`,
`scope`), so nothing needs an annotation.

`machine` turns LLVM's intermediate representation into machine code, `store` keeps it, `entry` is what Python calls,
with the arguments that `signature` reads from the documentation. `load` combines them; `loops` does so for functions of
a module.

There are two differences from Python: a negative index counts from the end only if it is a literal; an integer divided
by zero gives zero.
"""
