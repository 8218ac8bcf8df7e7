"""Compiled kernels: equations of motion and integrators as functions on arrays; imported only where a run starts.

Rules for a kernel:

1. It is plain Python that Numba compiles: the same source runs uncompiled with ``ERLS_JIT=0``, which a test uses.
2. It gets everything through its arguments, allocates nothing, and writes into the arrays it is given.
3. Functions of a compiled system have the signatures of `erls.equations.compiled_system`, so that an integrator is
   compiled once and calls any system through a pointer. Helpers need no signature (`erls.maths.jit.helper`).
4. What is off costs nothing: a part that a run does not need is skipped by a flag or an empty range, never multiplied
   by zero.
5. The code of a subpackage (the equations of one formulation, the integrators) is kept on disk under the digest of its
   source and of the subpackages whose functions it calls: what changes there compiles all of it again.
"""
