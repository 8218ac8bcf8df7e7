"""A chain whose fast modes follow statically, as kernels: `erls.formulations.quasi_static` around the functions of
`erls.kernels.chain`.
"""
