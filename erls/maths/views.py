"""Views into flat memory: arrays of any shape over a piece of a contiguous one, nothing checked and nothing copied.

NumPy's ``reshape`` in compiled code asks a library function whether it can do without copying, for each view and also
for those that nobody uses; these views are a pointer and a shape, which vanish where they are not used.
"""

from __future__ import annotations

from typing import Any

from erls.maths.jit import ENABLED


def plain_at(array: Any, start: int, *shape: int) -> Any:
    """The same in plain Python."""
    size = 1
    for n in shape:
        size *= int(n)
    return array[start : start + size].reshape(shape)


vector_at: Any = plain_at
"""``vector_at(array, start, n)``: (n,)."""
matrix_at: Any = plain_at
"""``matrix_at(array, start, m, n)``: (m, n)."""
stack_at: Any = plain_at
"""``stack_at(array, start, k, m, n)``: (k, m, n)."""
pile_at: Any = plain_at
"""``pile_at(array, start, l, k, m, n)``: (l, k, m, n)."""

if ENABLED:
    from numba.core import cgutils, types
    from numba.core.extending import intrinsic
    from numba.np.arrayobj import make_array, populate_array

    def _view(context: Any, builder: Any, base: Any, array: Any, start: Any, shape: list[Any]) -> Any:
        """Array struct over ``array`` from number ``start`` on."""
        result_type = types.Array(base.dtype, len(shape), "C")
        source = make_array(base)(context, builder, array)
        result = make_array(result_type)(context, builder)
        intp = context.get_value_type(types.intp)
        itemsize = context.get_constant(types.intp, context.get_abi_sizeof(context.get_data_type(base.dtype)))
        strides: list[Any] = []
        stride = itemsize
        for n in reversed(shape):
            strides.insert(0, stride)
            stride = builder.mul(stride, n)
        populate_array(
            result,
            data=builder.gep(source.data, [start]),
            shape=cgutils.pack_array(builder, shape, intp),
            strides=cgutils.pack_array(builder, strides, intp),
            itemsize=itemsize,
            meminfo=None,
            parent=None,
        )
        return result._getvalue()

    def _signature(array: Any, count: int) -> Any:
        return types.Array(array.dtype, count, "C")(array, *[types.intp] * (count + 1))

    @intrinsic
    def _vector(typing_context: Any, array: Any, start: Any, n: Any) -> Any:
        def generate(context: Any, builder: Any, signature: Any, args: Any) -> Any:
            return _view(context, builder, signature.args[0], args[0], args[1], [args[2]])

        return _signature(array, 1), generate

    @intrinsic
    def _matrix(typing_context: Any, array: Any, start: Any, m: Any, n: Any) -> Any:
        def generate(context: Any, builder: Any, signature: Any, args: Any) -> Any:
            return _view(context, builder, signature.args[0], args[0], args[1], [args[2], args[3]])

        return _signature(array, 2), generate

    @intrinsic
    def _stack(typing_context: Any, array: Any, start: Any, k: Any, m: Any, n: Any) -> Any:
        def generate(context: Any, builder: Any, signature: Any, args: Any) -> Any:
            return _view(context, builder, signature.args[0], args[0], args[1], [args[2], args[3], args[4]])

        return _signature(array, 3), generate

    @intrinsic
    def _pile(typing_context: Any, array: Any, start: Any, l: Any, k: Any, m: Any, n: Any) -> Any:
        def generate(context: Any, builder: Any, signature: Any, args: Any) -> Any:
            return _view(context, builder, signature.args[0], args[0], args[1], list(args[2:6]))

        return _signature(array, 4), generate

    for view in (_vector, _matrix, _stack, _pile):
        view.in_python = plain_at
    vector_at, matrix_at, stack_at, pile_at = _vector, _matrix, _stack, _pile
