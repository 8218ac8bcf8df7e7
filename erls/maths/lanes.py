"""Eight numbers as one in compiled code: eight states beside each other.

Equations are written for any scalar (`erls.maths.jit.any_scalar`), and this is one more: what processors do with eight
numbers costs about what it costs with one. Constants stay single numbers, which serve all eight. Equations choose by
their numbers now and then (which piece of a curve, does a contact touch): where the eight do not agree `Apart` is
raised, and whoever asked takes them one by one.
"""

from __future__ import annotations

import hashlib
import operator
from pathlib import Path
from typing import Any

import numpy as np
from llvmlite import ir
from numba.core import types as numba_types
from numba.core.datamodel import models
from numba.core.datamodel.registry import register_default
from numba.core.extending import intrinsic
from numba.core.imputils import lower_builtin, lower_cast, lower_getattr
from numba.core.typeconv import Conversion
from numba.core.typing.templates import AbstractTemplate, AttributeTemplate, infer_getattr, infer_global, signature

from erls.maths.array_code import DATA, SHAPE, contiguous, member

types: Any = numba_types
WIDTH = 8
_ALIGNED = 8 * WIDTH  # bytes: where arrays of such numbers begin
_ONE, _WHOLE, _PLACE = ir.DoubleType(), ir.IntType(WIDTH), ir.IntType(32)
_VECTOR = ir.VectorType(_ONE, WIDTH)
_NOTHING = ir.Constant(_VECTOR, [0.0] * WIDTH)
_OF_ONE = ir.FunctionType(_VECTOR, [_VECTOR])
_VERSION = hashlib.sha256(Path(__file__).read_bytes()).hexdigest()[:12]  # compiled code on disk goes by names of types


class Apart(ArithmeticError):
    """Eight states go different ways."""


class LanesType(numba_types.Type):  # not a Number, which Numba takes for one of NumPy's
    """Eight real numbers."""

    def __init__(self) -> None:
        super().__init__(name=f"{type(self).__name__}{WIDTH}-{_VERSION}")

    def can_convert_from(self, typingctx: Any, other: Any) -> Any:
        """From single numbers."""
        return Conversion.safe if isinstance(other, (types.Float, types.Integer)) else None

    def unify(self, typingctx: Any, other: Any) -> Any:
        """What may be one number or eight is eight."""
        return self if other == self or isinstance(other, (types.Float, types.Integer)) else None


lanes: Any = LanesType()


@register_default(LanesType)
class _Model(models.PrimitiveModel):  # type: ignore[misc]
    def __init__(self, manager: Any, kind: Any) -> None:
        super().__init__(manager, kind, _VECTOR)


def _spread(builder: Any, value: Any) -> Any:
    """One number eight times."""
    unknown = ir.Constant(_VECTOR, ir.Undefined)
    one = builder.insert_element(unknown, value, _PLACE(0))
    return builder.shuffle_vector(one, unknown, ir.Constant(ir.VectorType(_PLACE, WIDTH), [0] * WIDTH))


@lower_cast(types.Float, LanesType)  # type: ignore[untyped-decorator]
@lower_cast(types.Integer, LanesType)  # type: ignore[untyped-decorator]
@lower_cast(types.IntegerLiteral, LanesType)  # type: ignore[untyped-decorator]
def _lanes_of_one(context: Any, builder: Any, given: Any, wanted: Any, value: Any) -> Any:
    return _spread(builder, context.cast(builder, value, given, types.float64))


def _operation(operations: Any, result: Any, count: int, generate: Any) -> None:
    """Numba's rules for operations with such numbers, and with single ones among them."""
    numbers = types.Float, types.Integer

    class Rule(AbstractTemplate):  # type: ignore[misc]
        def generic(self, args: Any, kws: Any) -> Any:
            known = all(arg == lanes or isinstance(arg, numbers) for arg in args)
            if kws or len(args) != count or not known or lanes not in args:
                return None
            return signature(result, *[lanes] * count)

    for operation in operations:
        infer_global(operation)(type(f"{lanes}_{operation.__name__}", (Rule,), {"key": operation}))
        lower_builtin(operation, *[lanes] * count)(generate)


def _arithmetic(name: str) -> Any:
    def generate(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        return getattr(builder, name)(*args)

    return generate


def _intrinsic(name: str) -> Any:
    def generate(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        function = builder.module.declare_intrinsic(f"llvm.{name}.v{WIDTH}f64", fnty=_OF_ONE)
        return builder.call(function, args)

    return generate


def _called(context: Any, builder: Any, function: Any, args: Any) -> Any:
    """A function of single numbers."""
    kind = context.typing_context.resolve_value_type(function)
    found = context.typing_context.resolve_function_type(kind, [types.float64] * len(args), {})
    return context.get_function(kind, found)(builder, args)


def _one_by_one(function: Any) -> Any:
    def generate(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        result: Any = ir.Constant(_VECTOR, ir.Undefined)
        for k in range(WIDTH):
            each = [builder.extract_element(arg, _PLACE(k)) for arg in args]
            result = builder.insert_element(result, _called(context, builder, function, each), _PLACE(k))
        return result

    return generate


def _votes(sign: str) -> Any:
    """What eight states agree on."""

    def generate(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        compare = builder.fcmp_unordered if sign == "!=" else builder.fcmp_ordered
        votes = builder.bitcast(compare(sign, *args), _WHOLE)
        some = builder.icmp_unsigned("!=", votes, _WHOLE(0))
        every = builder.icmp_unsigned("==", votes, _WHOLE(2**WIDTH - 1))
        with builder.if_then(builder.xor(some, every), likely=False):
            context.call_conv.return_user_exc(builder, Apart, ("states that go different ways",))
        return some

    return generate


_SIGNS = {
    operator.lt: "<",
    operator.le: "<=",
    operator.gt: ">",
    operator.ge: ">=",
    operator.eq: "==",
    operator.ne: "!=",
}


def _register() -> None:
    sums = {(operator.add, operator.iadd): "fadd", (operator.sub, operator.isub): "fsub"}
    products = {(operator.mul, operator.imul): "fmul", (operator.truediv, operator.itruediv): "fdiv"}
    for operations, name in {**sums, **products}.items():
        _operation(operations, lanes, 2, _arithmetic(name))
    _operation((operator.neg,), lanes, 1, _arithmetic("fneg"))
    _operation((operator.pow,), lanes, 2, _one_by_one(operator.pow))
    for function, name in {np.sqrt: "sqrt", abs: "fabs"}.items():
        _operation((function,), lanes, 1, _intrinsic(name))
    for function in (np.cos, np.sin, np.tan, np.exp, np.log, np.tanh, np.cosh, np.sinh, np.arctan):
        _operation((function,), lanes, 1, _one_by_one(function))
    for compared, sign in _SIGNS.items():
        _operation((compared,), types.boolean, 2, _votes(sign))


_register()


class _Parts(AttributeTemplate):  # type: ignore[misc]
    def resolve_real(self, kind: Any) -> Any:
        return kind

    def resolve_imag(self, kind: Any) -> Any:
        return kind


infer_getattr(type("LanesParts", (_Parts,), {"key": LanesType}))


@lower_getattr(LanesType, "real")  # type: ignore[untyped-decorator]
def _real(context: Any, builder: Any, kind: Any, value: Any) -> Any:
    return value


@lower_getattr(LanesType, "imag")  # type: ignore[untyped-decorator]
def _imaginary(context: Any, builder: Any, kind: Any, value: Any) -> Any:
    return _NOTHING


def _seen_as(kind: Any) -> Any:
    def see(typing_context: Any, numbers: Any) -> Any:
        found = types.Array(kind, numbers.ndim - 1, "C")

        def generate(context: Any, builder: Any, sig: Any, given: Any) -> Any:
            data = builder.bitcast(member(builder, given[0], DATA), ir.PointerType(_VECTOR))
            shape = [member(builder, given[0], SHAPE, k) for k in range(numbers.ndim - 1)]
            return contiguous(context, builder, found, data, shape)

        return found(numbers), generate

    return intrinsic(see)


as_lanes = _seen_as(lanes)
"""(..., n) arrays of such numbers, of the memory that `eightfold` made."""


def eightfold(*shape: int) -> Any:
    """(..., 8) zeros where `as_lanes` may look at them."""
    count = int(np.prod(shape)) * WIDTH
    memory = np.zeros(count + WIDTH)
    first = (-memory.ctypes.data % _ALIGNED) // memory.itemsize
    return memory[first : first + count].reshape(*shape, WIDTH)
