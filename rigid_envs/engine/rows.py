"""Rows in memory, and the loops over them behind the NumPy interface of systems."""

from collections.abc import Callable, Iterable, Iterator
from typing import Any

import numpy as np
import numpy.typing as npt
from llvmlite import ir
from numba import types
from numba.core.typing.templates import Signature

from rigid_envs.engine.algebra import Row
from rigid_envs.engine.compiler import instruction, phase, scalar

# Memory layout of rows, and the loop that integrates them.
#
# A *block* holds `LANES` rows as a structure of arrays: see `place`. Because `LANES` is a constant,
# the compiler knows that the numbers of a row never overlap and turns every loop over the rows of a
# block into vector instructions. In arrays of the public interface the numbers of a row are
# adjacent.
#
# `get` and `put` copy some numbers of a row between a block and a tuple, `load` and `store` between
# an array and a tuple. Length and names of the tuple are those of a `prototype`, so that they are
# known at compile time. `load_single`, `store_single` and `store_byte` do the same for arrays, or
# parts of the buffer, that hold float32 or bytes; their positions are in units of these. Positions
# in an array of several axes are those of its memory.

Buffer = npt.NDArray[np.float64]
Step = Callable[[Row, Row, Row, float], Row]
Restore = Callable[[Row], Row]


LANES = 64

Prototype = Any
"""An instance of a `NamedTuple` of floats, for whose type and length loops are compiled."""


def prototype(kind: type[Any]) -> Prototype:
    """An instance of a `NamedTuple`: its defaults, 1 where it has none; () if it is empty.

    Raises:
        TypeError: not a `NamedTuple` of floats.
    """
    names = getattr(kind, "_fields", None)
    if names is None:
        raise TypeError(f"{kind!r}; expected a typing.NamedTuple whose fields are all floats")
    defaults = kind._field_defaults
    return kind(*(float(defaults.get(name, 1.0)) for name in names)) if names else ()


_Element = types.float64


def elements(
    context: Any, builder: Any, array: Any, value: Any, places: Iterable[Any], kind: Any = _Element
) -> list[Any]:
    """Pointers to elements of an array, as if it were one of a kind.

    Args:
        context: From numba, as the next ones.
        builder: Of instructions.
        array: Type of the array.
        value: The array.
        places: Indices: integers, or values of the code.
        kind: Type of an element.
    """
    data = context.make_array(array)(context, builder, value).data
    data = builder.bitcast(data, context.get_value_type(kind).as_pointer())
    index = context.get_value_type(types.intp)
    return [builder.gep(data, [index(k) if isinstance(k, int) else k]) for k in places]


def _spaced(builder: Any, start: Any, stride: Any, count: int) -> Iterator[Any]:
    """``start + k * stride`` for k below `count`."""
    for k in range(count):
        yield builder.add(start, builder.mul(ir.Constant(stride.type, k), stride))


def _places(builder: Any, where: Any, count: int) -> Iterator[Any]:
    """``base + (slot + k) * LANES + lane`` for k below `count`, where is (base, slot, lane)."""
    base, slot, lane = where
    lanes = ir.Constant(slot.type, LANES)
    start = builder.add(builder.add(base, builder.mul(slot, lanes)), lane)
    return _spaced(builder, start, lanes, count)


@instruction
def place(_context: Any, base: Any, slot: Any, lane: Any) -> tuple[Signature, Callable[..., Any]]:
    """``base + slot * LANES + lane``: of number `slot` of row `lane` in the block at `base`."""

    def generate(_context: Any, builder: Any, _signature: Any, arguments: Any) -> Any:
        return next(_places(builder, arguments, 1))

    return types.intp(types.intp, types.intp, types.intp), generate


@instruction
def get(
    _context: Any, array: Any, base: Any, slot: Any, lane: Any, like: Any
) -> tuple[Signature, Callable[..., Any]]:
    """Numbers of row `lane` of a block, from `slot` on, as many as `like` has."""
    result = _row_type(like, types.float64)

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        places = _places(builder, arguments[1:4], len(like))
        at = elements(context, builder, signature.args[0], arguments[0], places)
        return context.make_tuple(builder, result, map(builder.load, at))

    return result(array, types.intp, types.intp, types.intp, like), generate


@instruction
def put(
    _context: Any, array: Any, base: Any, slot: Any, lane: Any, values: Any
) -> tuple[Signature, Callable[..., Any]]:
    """Write numbers of row `lane` of a block, from `slot` on."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        entries = _entries(context, builder, values, arguments[4], types.float64)
        places = _places(builder, arguments[1:4], len(entries))
        at = elements(context, builder, signature.args[0], arguments[0], places)
        for entry, here in zip(entries, at, strict=True):
            builder.store(entry, here)
        return context.get_dummy_value()

    return types.void(array, types.intp, types.intp, types.intp, values), generate


def _entries(context: Any, builder: Any, row: Any, value: Any, number: Any) -> list[Any]:
    """Entries of a row, then the defaults of those it was made without: numba leaves them out."""
    kind: Any = getattr(row, "instance_class", None)
    left_out = () if kind is None else kind._fields[len(row) :]
    pieces = [(builder.extract_value(value, k), given) for k, given in enumerate(row)]
    entries = [context.cast(builder, piece, given, number) for piece, given in pieces]
    return entries + [context.get_constant(number, kind._field_defaults[name]) for name in left_out]


def _row_type(like: Any, number: Any) -> Any:
    """Type of a row with the length and names of another one."""
    if isinstance(like, types.BaseNamedTuple):
        return types.NamedUniTuple(number, len(like), like.instance_class)
    return types.UniTuple(number, len(like)) if len(like) else types.Tuple(())


def _load_as(kind: Any) -> Callable[..., Any]:
    """Instruction that reads numbers of a type; None for the type of the array."""

    def load(
        _context: Any, array: Any, start: Any, like: Any, stride: Any
    ) -> tuple[Signature, Callable[..., Any]]:
        """``tuple(array[start + k * stride] for k in range(len(like)))``."""
        source, target = kind or array.dtype, types.float64 if kind else array.dtype
        result = _row_type(like, target)

        def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
            array, start, _, stride = arguments
            places = _spaced(builder, start, stride, len(like))
            at = elements(context, builder, signature.args[0], array, places, source)
            values = [context.cast(builder, builder.load(p), source, target) for p in at]
            return context.make_tuple(builder, result, values)

        return result(array, types.intp, like, types.intp), generate

    return instruction(load)


def _store_as(kind: Any) -> Callable[..., None]:
    """Instruction that writes numbers of a type; None for the type of the array."""

    def store(
        _context: Any, array: Any, start: Any, values: Any, stride: Any
    ) -> tuple[Signature, Callable[..., Any]]:
        """Write ``values[k]`` to ``array[start + k * stride]`` for every k."""
        target = kind or array.dtype

        def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
            array, start, row, stride = arguments
            entries = _entries(context, builder, values, row, target)
            places = _spaced(builder, start, stride, len(entries))
            at = elements(context, builder, signature.args[0], array, places, target)
            for entry, here in zip(entries, at, strict=True):
                builder.store(entry, here)
            return context.get_dummy_value()

        return types.void(array, types.intp, values, types.intp), generate

    return instruction(store)


load, store = _load_as(None), _store_as(None)
load_single, store_single = _load_as(types.float32), _store_as(types.float32)
store_byte = _store_as(types.uint8)


@instruction
def store_nonzero(
    _context: Any, array: Any, start: Any, target: Any, place: Any
) -> tuple[Signature, Callable[..., Any]]:
    """Set ``target[place + k]`` to whether ``array[start + k]`` is not 0, k < 8."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        array, start, target, place = arguments
        data = context.make_array(signature.args[0])(context, builder, array).data
        bytes_of = context.make_array(signature.args[2])(context, builder, target).data
        byte, double = ir.IntType(8), ir.VectorType(ir.DoubleType(), 8)
        source = builder.bitcast(builder.gep(data, [start]), double.as_pointer())
        numbers = builder.load(source, align=8)
        bytes_ = ir.VectorType(byte, 8)
        signs = builder.zext(builder.fcmp_unordered("!=", numbers, double(None)), bytes_)
        at = builder.gep(builder.bitcast(bytes_of, byte.as_pointer()), [place])
        builder.store(signs, builder.bitcast(at, bytes_.as_pointer()), align=1)
        return context.get_dummy_value()

    return types.void(array, types.intp, target, types.intp), generate


@instruction
def store_tile(
    _context: Any, array: Any, start: Any, target: Any, place: Any, width: Any
) -> tuple[Signature, Callable[..., Any]]:
    """Write ``array[start + k * LANES + i]`` to ``target[place + i * width + k]``, i < 8, k < 4."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        array, start, target, place, width = arguments
        data = context.make_array(signature.args[0])(context, builder, array).data
        singles_of = context.make_array(signature.args[2])(context, builder, target).data
        doubles, singles = ir.VectorType(ir.DoubleType(), 8), ir.VectorType(ir.FloatType(), 8)

        def column(k: int) -> Any:
            at = builder.gep(data, [builder.add(start, ir.Constant(start.type, k * LANES))])
            at = builder.bitcast(at, doubles.as_pointer())
            return builder.fptrunc(builder.load(at, align=8), singles)

        def mixed(a: Any, b: Any, *lanes: int) -> Any:
            return builder.shuffle_vector(a, b, ir.Constant(_lanes(lanes), lanes))

        # rows 0, 1, 4, 5 of two columns, and 2, 3, 6, 7; then rows i and i + 4 of all four
        a, b, c, d = map(column, range(4))
        early, late = (0, 8, 1, 9, 4, 12, 5, 13), (2, 10, 3, 11, 6, 14, 7, 15)
        first, second = (0, 1, 8, 9, 4, 5, 12, 13), (2, 3, 10, 11, 6, 7, 14, 15)
        pairs = [(mixed(a, b, *half), mixed(c, d, *half)) for half in (early, late)]
        rows = [mixed(*pair, *half) for pair in pairs for half in (first, second)]
        for i in range(8):
            row = mixed(rows[i % 4], rows[i % 4], *range(i // 4 * 4, i // 4 * 4 + 4))
            offset = builder.mul(width, ir.Constant(width.type, i))
            at = builder.gep(singles_of, [builder.add(place, offset)])
            builder.store(row, builder.bitcast(at, row.type.as_pointer()), align=4)
        return context.get_dummy_value()

    return types.void(array, types.intp, target, types.intp, types.intp), generate


@instruction
def load_tile(
    _context: Any, array: Any, start: Any, place: Any, like: Any
) -> tuple[Signature, Callable[..., Any]]:
    """Read float32 ``start + i * len(like) + k`` to ``array[place + k * LANES + i]``, i < 8."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        array, start, place, _ = arguments
        data = context.make_array(signature.args[0])(context, builder, array).data
        single, doubles = ir.FloatType(), ir.VectorType(ir.DoubleType(), 8)
        rows = ir.VectorType(single, 8 * len(like))
        source = builder.gep(builder.bitcast(data, single.as_pointer()), [start])
        numbers = builder.load(builder.bitcast(source, rows.as_pointer()), align=4)
        for k in range(len(like)):
            lanes = tuple(range(k, 8 * len(like), len(like)))
            column = builder.shuffle_vector(numbers, numbers, ir.Constant(_lanes(lanes), lanes))
            at = builder.gep(data, [builder.add(place, ir.Constant(place.type, k * LANES))])
            at = builder.bitcast(at, doubles.as_pointer())
            builder.store(builder.fpext(column, doubles), at, align=8)
        return context.get_dummy_value()

    return types.void(array, types.intp, types.intp, like), generate


def _lanes(lanes: tuple[int, ...]) -> Any:
    return ir.VectorType(ir.IntType(32), len(lanes))


@phase
def advance_rows(
    step: Step, prototypes: tuple[Row, Row, Row], buffer: Buffer, base: int, n: int, h: float
) -> None:
    """Apply ``step(y, u, p, h)`` to the first n rows of a block.

    State, inputs and parameters (`prototypes`) are adjacent in the block, in this order.
    """
    state, inputs, parameters = prototypes
    for i in range(n):
        y = get(buffer, base, 0, i, state)
        u = get(buffer, base, len(state), i, inputs)
        p = get(buffer, base, len(state) + len(inputs), i, parameters)
        put(buffer, base, 0, i, step(y, u, p, h))


@phase
def restore_rows(restore: Restore, state: Row, buffer: Buffer, base: int, n: int) -> None:
    """Apply ``restore(y)`` to the first n rows of a block."""
    for i in range(n):
        put(buffer, base, 0, i, restore(get(buffer, base, 0, i, state)))


@phase
def integrate(
    step: Step,
    restore: Restore,
    weights: Row,
    prototypes: tuple[Row, Row, Row],
    buffer: Buffer,
    base: int,
    n: int,
    h: float,
    n_substeps: int,
) -> None:
    """Advance the first n rows of a block by `n_substeps` steps of length h [s].

    The symmetric second-order map `step` is composed with itself at lengths ``weights[j] * h``. The
    loop over rows is the innermost one; its data stay in the first-level cache.
    """
    for _ in range(n_substeps):
        for weight in weights:
            advance_rows(step, prototypes, buffer, base, n, weight * h)
        restore_rows(restore, prototypes[0], buffer, base, n)


# Loops of the NumPy interface of the systems, on arrays of shape (N, n).

Array = npt.NDArray[Any]
Function = Callable[..., Row]


@scalar
def evaluate(
    function: Function, prototypes: tuple[Row, Row, Row], y: Array, u: Array, p: Array, out: Array
) -> None:
    """``out[i] = function(y[i], u[i], p)``; real or complex."""
    state, inputs, parameters = prototypes
    p_row = load(p, 0, parameters, 1)
    for i in range(y.shape[0]):
        y_row = load(y, i * len(state), state, 1)
        u_row = load(u, i * len(inputs), inputs, 1)
        values = function(y_row, u_row, p_row)
        store(out, i * out.shape[1], values, 1)


@scalar
def measure(
    invariants: Function, prototypes: tuple[Row, Row, Row], y: Array, p: Array, out: Array
) -> None:
    """``out[i] = invariants(y[i], p)``."""
    state, _, parameters = prototypes
    p_row = load(p, 0, parameters, 1)
    for i in range(y.shape[0]):
        values = invariants(load(y, i * len(state), state, 1), p_row)
        store(out, i * out.shape[1], values, 1)


@scalar
def rates(
    rate: Callable[..., float], prototypes: tuple[Row, Row, Row], y: Array, p: Array, out: Array
) -> None:
    """``out[i] = rate(y[i], p)``."""
    state, _, parameters = prototypes
    p_row = load(p, 0, parameters, 1)
    for i in range(y.shape[0]):
        out[i] = rate(load(y, i * len(state), state, 1), p_row)


@scalar
def simulate(
    step: Step,
    restore: Restore,
    weights: Array,
    prototypes: tuple[Row, Row, Row],
    p: Array,
    u: Array,
    u_per_stage: bool,
    h: Array,
    n_substeps: Array,
    y: Array,
) -> None:
    """Fill ``y[m + 1]`` from ``y[m]``, shape (M + 1, N, n_state), for all M intervals.

    Interval m is integrated in ``n_substeps[m]`` steps of length ``h[m]`` [s]. The input is
    ``u[0]`` throughout; with `u_per_stage` each stage has its own input, in sequence.
    """
    state, inputs, parameters = prototypes
    block = np.empty((len(state) + len(inputs) + len(parameters)) * LANES)
    p_row = load(p, 0, parameters, 1)
    n_rows = y.shape[1]
    for row in range(0, n_rows, LANES):
        n = min(LANES, n_rows - row)
        for i in range(n):
            put(block, 0, len(state) + len(inputs), i, p_row)
            put(block, 0, 0, i, load(y, (row + i) * len(state), state, 1))
        k = 0
        _hold(block, inputs, len(state), u, k, row, n)
        for m in range(h.size):
            for _ in range(n_substeps[m]):
                for j in range(weights.size):
                    if u_per_stage:
                        _hold(block, inputs, len(state), u, k, row, n)
                        k += 1
                    advance_rows(step, prototypes, block, 0, n, weights[j] * h[m])
                restore_rows(restore, state, block, 0, n)
            target = ((m + 1) * n_rows + row) * len(state)
            for i in range(n):
                store(y, target + i * len(state), get(block, 0, 0, i, state), 1)


@scalar
def _hold(block: Array, inputs: Row, slot: int, u: Array, k: int, row: int, n: int) -> None:
    """Copy input k of n rows into the block; a shared input has ``u.shape[1] == 1``."""
    n_inputs, shared = len(inputs), u.shape[1] == 1
    for i in range(n):
        source = k * u.shape[1] * n_inputs + (0 if shared else row + i) * n_inputs
        put(block, 0, slot, i, load(u, source, inputs, 1))
