"""A chain whose fast modes follow statically, as kernels: `erls.equations.quasi_static.formulation` around the
functions of `erls.equations.erls`.
"""
