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
    from numba.core.extending import intrinsic

    from erls.maths.array_code import DATA, contiguous, member, types

    def _view(axes: int) -> Any:
        def view(typing_context: Any, array: Any, start: Any, *shape: Any) -> Any:
            kind = types.Array(array.dtype, axes, "C")

            def generate(context: Any, builder: Any, signature: Any, given: Any) -> Any:
                base, first, dims = given[0], given[1], given[2]
                lengths = [member(builder, dims, k) for k in range(axes)]
                address = builder.gep(member(builder, base, DATA), [first])
                return contiguous(context, builder, kind, address, lengths)

            return kind(array, types.intp, types.StarArgTuple((types.intp,) * axes)), generate

        found = intrinsic(view)
        found.in_python = plain_at
        return found

    vector_at, matrix_at, stack_at, pile_at = map(_view, (1, 2, 3, 4))
