"""Records in compiled code: three addresses, by which a field is found when it is asked for.

A `NamedTuple` of some dozens of arrays would be hundreds of numbers that every call hands over. Here a record is where
its numbers, the integers and its table lie (`erls.maths.records`); only the fields that are used are looked up. As
tables never change while compiled code runs, what is looked up again and again is looked up once.
"""

from __future__ import annotations

from typing import Any

from llvmlite import ir
from numba.core import types as numba_types
from numba.core.datamodel import models
from numba.core.datamodel.registry import register_default
from numba.core.extending import intrinsic
from numba.core.imputils import lower_getattr_generic
from numba.core.typing.templates import AttributeTemplate, infer_getattr

from erls.maths.array_code import DATA, contiguous, member

types: Any = numba_types
NUMBERS, INTEGERS, TABLE = range(3)


class RecordType(numba_types.Type):
    """A record of numbers of one type, real or complex.

    Parameters
    ----------
    record : NamedTuple class
    fields : tuple of (str, int or None, bool)
        Name, axes (0 of a real number, None of an integer), and whether it lies in the integers.
    dtype : Numba type
    """

    def __init__(self, record: type[Any], fields: tuple[tuple[str, int | None, bool], ...], dtype: Any) -> None:
        self.dtype = dtype
        self.places: dict[str, tuple[int, int | None, bool]] = {}
        place = 0
        for name, axes, whole in fields:
            self.places[name] = place, axes, whole
            place += 1 if axes is None else 1 + axes
        super().__init__(name=f"{record.__module__}.{record.__qualname__}({dtype})")

    def of(self, name: str) -> Any:
        """Type of a field."""
        _, axes, whole = self.places[name]
        if axes is None:
            return types.intp
        return types.Array(types.int64 if whole else self.dtype, axes, "C") if axes else self.dtype


@register_default(RecordType)
class _Addresses(models.StructModel):  # type: ignore[misc]
    def __init__(self, manager: Any, kind: Any) -> None:
        numbers, integers = types.CPointer(kind.dtype), types.CPointer(types.int64)
        super().__init__(manager, kind, [("numbers", numbers), ("integers", integers), ("table", integers)])


@infer_getattr
class _Fields(AttributeTemplate):  # type: ignore[misc]
    key = RecordType

    def generic_resolve(self, kind: Any, name: str) -> Any:
        return kind.of(name) if name in kind.places else None


@lower_getattr_generic(RecordType)  # type: ignore[untyped-decorator]
def _look_up(context: Any, builder: Any, kind: Any, record: Any, name: str) -> Any:
    place, axes, whole = kind.places[name]
    table = member(builder, record, TABLE)

    def entry(number: int) -> Any:
        found = builder.load(builder.gep(table, [context.get_constant(types.intp, place + number)]))
        found.set_metadata("invariant.load", builder.module.add_metadata([]))
        return found

    if axes is None:
        return entry(0)
    field = kind.of(name)
    address = builder.gep(member(builder, record, INTEGERS if whole else NUMBERS), [entry(0)])
    if axes == 0:
        return context.unpack_value(builder, field, address)
    return contiguous(context, builder, field, address, [entry(1 + axis) for axis in range(axes)])


def reader(record: type[Any], fields: tuple[tuple[str, int | None, bool], ...]) -> Any:
    """``read(numbers, integers, at)`` in compiled functions."""

    def read(typing_context: Any, numbers: Any, integers: Any, at: Any) -> Any:
        kind = RecordType(record, fields, numbers.dtype)

        def generate(context: Any, builder: Any, signature: Any, given: Any) -> Any:
            flat, whole = (member(builder, array, DATA) for array in given[:2])
            result = ir.Constant(context.get_value_type(kind), ir.Undefined)
            for place, address in ((NUMBERS, flat), (INTEGERS, whole), (TABLE, builder.gep(whole, [given[2]]))):
                result = builder.insert_value(result, address, place)
            return result

        return kind(numbers, integers, types.intp), generate

    return intrinsic(read)
