"""What compiled code does with contiguous arrays: elements, rows, pieces of rows and shapes in few instructions.

Numba copies the description of an array (seven members, strides and owner among them) to the stack for every element
that is read or written, and looks at all of it; some thirty instructions for one address. They vanish when the code is
optimized, but most of compilation is spent on them. This has the same meaning (negative indices count from the end,
slices end where the array does, nothing else is checked) for arrays of real, complex and whole numbers in C order.
"""

from __future__ import annotations

import operator
from collections.abc import Sequence
from functools import cache
from typing import Any

import numba
from llvmlite import ir
from numba.core import cgutils
from numba.core import types as numba_types
from numba.core.imputils import impl_ret_borrowed, lower_builtin, lower_getattr
from numba.np.arrayobj import load_item, store_item

types: Any = numba_types
AXES = range(1, 5)
OWNER, PARENT, DATA, SHAPE = 0, 1, 4, 5  # members of Numba's description of an array
_LAST = 2**63 - 1  # where a slice without end stops


def member(builder: Any, value: Any, *places: int) -> Any:
    """Member of a structure, or of its member: what was put there, where that is known."""
    for place in places:
        holder = value
        while isinstance(holder, ir.instructions.InsertValue) and holder.indices[0] != place:
            holder = holder.aggregate
        known = isinstance(holder, ir.instructions.InsertValue) and len(holder.indices) == 1
        value = holder.value if known else builder.extract_value(holder, place)
    return value


def contiguous(context: Any, builder: Any, kind: Any, data: Any, shape: Sequence[Any], base: Any = None) -> Any:
    """Description of the contiguous array at an address, which belongs to what ``base`` belongs to, or to nobody."""
    whole = context.get_value_type(kind)
    size = context.get_constant(types.intp, context.get_abi_sizeof(context.get_data_type(kind.dtype)))
    numbers: Any = None
    strides: list[Any] = []
    for n in reversed(shape):
        strides.insert(0, size if numbers is None else builder.mul(size, numbers))
        numbers = n if numbers is None else builder.mul(numbers, n)
    result = ir.Constant(whole, ir.Undefined)
    owners = [
        ir.Constant(whole.elements[k], None) if base is None else member(builder, base, k) for k in (OWNER, PARENT)
    ]
    ends = [cgutils.pack_array(builder, each, size.type) for each in (shape, strides)]
    for place, part in enumerate([*owners, numbers, size, data, *ends]):
        result = builder.insert_value(result, part, place)
    return result


def _at(builder: Any, index: Any, size: Any) -> Any:
    """Place of an index, which counts from the end where it is negative."""
    if isinstance(index, ir.Constant):
        return index if index.constant >= 0 else builder.add(index, size)
    return builder.select(builder.icmp_signed("<", index, index.type(0)), builder.add(index, size), index)


def _bound(builder: Any, index: Any, size: Any) -> Any:
    """Place of an end of a slice, within the array."""
    if isinstance(index, ir.Constant) and index.constant in (0, _LAST):
        return size if index.constant else index
    place = _at(builder, index, size)
    if not isinstance(place, ir.Constant):
        place = builder.select(builder.icmp_signed("<", place, place.type(0)), place.type(0), place)
    return builder.select(builder.icmp_signed(">", place, size), size, place)


def _address(builder: Any, kind: Any, array: Any, index_kind: Any, index: Any) -> tuple[Any, list[Any]]:
    """Where an element, a row or a piece of a row begins, and the shape of what begins there."""
    several = isinstance(index_kind, types.BaseTuple)
    indices = [member(builder, index, k) for k in range(len(index_kind))] if several else [index]
    kinds = list(index_kind) if several else [index_kind]
    shape = [member(builder, array, SHAPE, axis) for axis in range(kind.ndim)]
    rest = shape[len(indices) :]
    offset: Any = None
    for i, i_kind, n in zip(indices, kinds, shape, strict=False):
        if isinstance(i_kind, types.SliceType):  # the last one
            place, stop = (_bound(builder, member(builder, i, k), n) for k in (0, 1))
            length = builder.sub(stop, place)
            rest = [builder.select(builder.icmp_signed("<", length, length.type(0)), length.type(0), length)]
        else:
            place = _at(builder, i, n) if i_kind.signed else i
        offset = place if offset is None else builder.add(builder.mul(offset, n), place)
    for n in shape[len(indices) :]:
        offset = builder.mul(offset, n)
    return builder.gep(member(builder, array, DATA), [offset]), rest


def _get(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
    kind, index_kind = signature.args
    address, rest = _address(builder, kind, arguments[0], index_kind, arguments[1])
    if not rest:
        return load_item(context, builder, kind, address)
    row = contiguous(context, builder, signature.return_type, address, rest, arguments[0])
    return impl_ret_borrowed(context, builder, signature.return_type, row)


def _set(context: Any, builder: Any, signature: Any, arguments: Any) -> None:
    kind, index_kind, value_kind = signature.args
    address, _ = _address(builder, kind, arguments[0], index_kind, arguments[1])
    store_item(context, builder, kind, context.cast(builder, arguments[2], value_kind, kind.dtype), address)


def _shape(context: Any, builder: Any, kind: Any, array: Any) -> Any:
    return member(builder, array, SHAPE)


def _length(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
    return member(builder, arguments[0], SHAPE, 0)


@cache
def register() -> None:
    """Have Numba use this from now on, unless it is asked to check all indices (``NUMBA_BOUNDSCHECK``)."""
    if numba.config.BOUNDSCHECK:
        return
    for dtype in (types.float64, types.complex128, types.int64):
        for axes in AXES:
            kind = types.Array(dtype, axes, "C")
            lower_getattr(kind, "shape")(_shape)
            lower_builtin(len, kind)(_length)
            piece = types.slice2_type if axes == 1 else types.Tuple((types.intp,) * (axes - 1) + (types.slice2_type,))
            whole = (types.intp, types.uintp) if axes == 1 else (types.UniTuple(types.intp, axes),)
            rows = () if axes == 1 else (types.intp, types.uintp)
            more = (types.UniTuple(types.intp, n) for n in range(2, axes))
            for index in (piece, *whole, *rows, *more):
                lower_builtin(operator.getitem, kind, index)(_get)
            for index in whole:
                for number in (types.Number, types.Boolean):
                    lower_builtin(operator.setitem, kind, index, number)(_set)
