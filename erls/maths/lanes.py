"""Eight numbers as one in compiled code: eight states at a time, or a value with its derivatives along seven ways.

Equations are written for any scalar (`erls.maths.jit.any_scalar`), and these are two more: what processors do with
eight numbers costs about what it costs with one. Constants stay single numbers, which serve all eight.

`lanes` are eight states beside each other. Equations choose by their numbers now and then (which piece of a curve, does
a contact touch): where the eight do not agree `Apart` is raised, and whoever asked takes them one by one.

`dual` is a value and what it changes by along seven directions, x + Σ ε_k x_k with ε_k ε_l = 0: its functions are exact
derivatives, without steps. Choices are those of the value.
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
WAYS = WIDTH - 1
"""Directions of a `dual`."""
_ALIGNED = 8 * WIDTH  # bytes: where arrays of such numbers begin
_ONE, _WHOLE, _PLACE = ir.DoubleType(), ir.IntType(WIDTH), ir.IntType(32)
_VECTOR = ir.VectorType(_ONE, WIDTH)
_NOTHING = ir.Constant(_VECTOR, [0.0] * WIDTH)
_OF_ONE = ir.FunctionType(_VECTOR, [_VECTOR])
_VERSION = hashlib.sha256(Path(__file__).read_bytes()).hexdigest()[:12]  # compiled code on disk goes by names of types


class Apart(ArithmeticError):
    """Eight states go different ways."""


class _Eight(numba_types.Type):  # not a Number, which Numba takes for one of NumPy's
    def __init__(self) -> None:
        super().__init__(name=f"{type(self).__name__}{WIDTH}-{_VERSION}")

    def can_convert_from(self, typingctx: Any, other: Any) -> Any:
        """From single numbers."""
        return Conversion.safe if isinstance(other, (types.Float, types.Integer)) else None

    def unify(self, typingctx: Any, other: Any) -> Any:
        """What may be one number or eight is eight."""
        return self if other == self or isinstance(other, (types.Float, types.Integer)) else None


class LanesType(_Eight):
    """Eight real numbers."""


class DualType(_Eight):
    """A value, and its derivatives along seven directions."""


lanes: Any = LanesType()
dual: Any = DualType()


@register_default(LanesType)
@register_default(DualType)
class _Model(models.PrimitiveModel):  # type: ignore[misc]
    def __init__(self, manager: Any, kind: Any) -> None:
        super().__init__(manager, kind, _VECTOR)


def _spread(builder: Any, value: Any) -> Any:
    """One number eight times."""
    unknown = ir.Constant(_VECTOR, ir.Undefined)
    one = builder.insert_element(unknown, value, _PLACE(0))
    return builder.shuffle_vector(one, unknown, ir.Constant(ir.VectorType(_PLACE, WIDTH), [0] * WIDTH))


def _value(builder: Any, x: Any) -> Any:
    return builder.extract_element(x, _PLACE(0))


def _with_value(builder: Any, x: Any, value: Any) -> Any:
    return builder.insert_element(x, value, _PLACE(0))


def _ways(builder: Any, x: Any) -> Any:
    """Derivatives alone."""
    return _with_value(builder, x, _ONE(0.0))


@lower_cast(types.Float, LanesType)  # type: ignore[untyped-decorator]
@lower_cast(types.Integer, LanesType)  # type: ignore[untyped-decorator]
@lower_cast(types.IntegerLiteral, LanesType)  # type: ignore[untyped-decorator]
def _lanes_of_one(context: Any, builder: Any, given: Any, wanted: Any, value: Any) -> Any:
    return _spread(builder, context.cast(builder, value, given, types.float64))


@lower_cast(types.Float, DualType)  # type: ignore[untyped-decorator]
@lower_cast(types.Integer, DualType)  # type: ignore[untyped-decorator]
@lower_cast(types.IntegerLiteral, DualType)  # type: ignore[untyped-decorator]
def _constant(context: Any, builder: Any, given: Any, wanted: Any, value: Any) -> Any:
    return _with_value(builder, _NOTHING, context.cast(builder, value, given, types.float64))


def _operation(kind: Any, operations: Any, result: Any, count: int, generate: Any, mixed: Any = None) -> None:
    """Numba's rules for operations with numbers of a kind; ``mixed`` where a single number comes first or last."""
    numbers = types.Float, types.Integer

    class Rule(AbstractTemplate):  # type: ignore[misc]
        def generic(self, args: Any, kws: Any) -> Any:
            found = [kind if arg == kind else types.float64 if isinstance(arg, numbers) else None for arg in args]
            if kws or len(args) != count or None in found or kind not in found:
                return None
            return signature(result, *(found if mixed else [kind] * count))

    for operation in operations:
        infer_global(operation)(type(f"{kind}_{operation.__name__}", (Rule,), {"key": operation}))
        lower_builtin(operation, *[kind] * count)(generate)
        if mixed:
            lower_builtin(operation, types.float64, kind)(mixed)
            lower_builtin(operation, kind, types.float64)(mixed)


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


def _of_values(sign: str) -> Any:
    def generate(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        compare = builder.fcmp_unordered if sign == "!=" else builder.fcmp_ordered
        return compare(sign, *(_value(builder, arg) for arg in args))

    return generate


def _product(context: Any, builder: Any, sig: Any, args: Any) -> Any:
    """(x y)' = x y' + y x'."""
    x, y = args
    first = builder.fmul(_spread(builder, _value(builder, x)), y)
    return builder.fadd(first, builder.fmul(_spread(builder, _value(builder, y)), _ways(builder, x)))


def _scaled(context: Any, builder: Any, sig: Any, args: Any) -> Any:
    """Of a constant and a dual."""
    both = zip(sig.args, args, strict=True)
    return builder.fmul(*(arg if kind == dual else _spread(builder, arg) for kind, arg in both))


def _quotient(context: Any, builder: Any, sig: Any, args: Any) -> Any:
    """q = x / y, q' = (x' - q y') / y."""
    x, y = args
    below = _value(builder, y)
    found = _spread(builder, builder.fdiv(_value(builder, x), below))
    change = builder.fsub(x, builder.fmul(found, _ways(builder, y)))
    return builder.fdiv(change, _spread(builder, below))


def _mixed_quotient(context: Any, builder: Any, sig: Any, args: Any) -> Any:
    """Of a constant and a dual, either way."""
    if sig.args[1] == types.float64:
        return builder.fdiv(args[0], _spread(builder, args[1]))
    return _quotient(context, builder, sig, [_with_value(builder, _NOTHING, args[0]), args[1]])


def _chain(function: Any, slope: Any) -> Any:
    """f(x)' = f'(x) x'; the slope is made of x and f(x), by a function that is compiled for single numbers."""

    def generate(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        at = _value(builder, args[0])
        found = _called(context, builder, function, [at])

        steep = context.compile_internal(builder, slope, signature(*[types.float64] * 3), [at, found])
        return _with_value(builder, builder.fmul(_spread(builder, steep), args[0]), found)

    return generate


def _power(context: Any, builder: Any, sig: Any, args: Any) -> Any:
    """x^c of a constant c, (x^c)' = c x^(c - 1) x'."""
    at, exponent = _value(builder, args[0]), args[1]
    found = _called(context, builder, operator.pow, [at, exponent])
    less = _called(context, builder, operator.pow, [at, builder.fsub(exponent, _ONE(1.0))])
    steep = _spread(builder, builder.fmul(exponent, less))
    return _with_value(builder, builder.fmul(steep, args[0]), found)


_SLOPES = {
    np.sqrt: lambda x, f: 0.5 / f,
    np.cos: lambda x, f: -np.sin(x),
    np.sin: lambda x, f: np.cos(x),
    np.tan: lambda x, f: 1.0 + f * f,
    np.exp: lambda x, f: f,
    np.log: lambda x, f: 1.0 / x,
    np.tanh: lambda x, f: 1.0 - f * f,
    np.cosh: lambda x, f: np.sinh(x),
    np.sinh: lambda x, f: np.cosh(x),
    np.arctan: lambda x, f: 1.0 / (1.0 + x * x),
    abs: lambda x, f: 1.0 if x > 0.0 else -1.0 if x < 0.0 else 0.0,
}
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
        _operation(lanes, operations, lanes, 2, _arithmetic(name))
    for operations, name in sums.items():
        _operation(dual, operations, dual, 2, _arithmetic(name))
    (times, over) = products
    _operation(dual, times, dual, 2, _product, _scaled)
    _operation(dual, over, dual, 2, _quotient, _mixed_quotient)
    for kind in (lanes, dual):
        _operation(kind, (operator.neg,), kind, 1, _arithmetic("fneg"))
    _operation(lanes, (operator.pow,), lanes, 2, _one_by_one(operator.pow))
    _operation(dual, (operator.pow,), dual, 2, _power, _power)
    at_once = {np.sqrt: "sqrt", abs: "fabs"}
    for function, slope in _SLOPES.items():
        several = _intrinsic(at_once[function]) if function in at_once else _one_by_one(function)
        _operation(lanes, (function,), lanes, 1, several)
        _operation(dual, (function,), dual, 1, _chain(function, slope))
    for compared, sign in _SIGNS.items():
        _operation(lanes, (compared,), types.boolean, 2, _votes(sign))
        _operation(dual, (compared,), types.boolean, 2, _of_values(sign))


_register()


class _Parts(AttributeTemplate):  # type: ignore[misc]
    def resolve_real(self, kind: Any) -> Any:
        return kind

    def resolve_imag(self, kind: Any) -> Any:
        return kind


for _kind in (LanesType, DualType):
    infer_getattr(type(f"{_kind.__name__}Parts", (_Parts,), {"key": _kind}))


@lower_getattr(LanesType, "real")  # type: ignore[untyped-decorator]
@lower_getattr(DualType, "real")  # type: ignore[untyped-decorator]
def _real(context: Any, builder: Any, kind: Any, value: Any) -> Any:
    return value


@lower_getattr(LanesType, "imag")  # type: ignore[untyped-decorator]
@lower_getattr(DualType, "imag")  # type: ignore[untyped-decorator]
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


as_lanes, as_duals = _seen_as(lanes), _seen_as(dual)
"""(..., n) arrays of such numbers, of the memory that `eightfold` made."""


def eightfold(*shape: int) -> Any:
    """(..., 8) zeros where `as_lanes` and `as_duals` may look at them."""
    count = int(np.prod(shape)) * WIDTH
    memory = np.zeros(count + WIDTH)
    first = (-memory.ctypes.data % _ALIGNED) // memory.itemsize
    return memory[first : first + count].reshape(*shape, WIDTH)
