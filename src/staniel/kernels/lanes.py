"""Sums, maxima, exponentials and logarithms over float32 arrays, the same on every machine.

The order of a sum that LLVM vectorises by itself depends on how wide the processor's registers are.
So these sums say their order: they are written in LLVM's own words, as vectors of `LANES`, which
any processor has or makes do for.
"""

import math
from collections.abc import Callable, Sequence
from functools import partial, reduce
from typing import Any, cast

import numpy as np
from llvmlite import ir
from numba import njit, types
from numba.core import cgutils
from numba.extending import intrinsic
from numpy.typing import NDArray

__all__ = [
    "exp32",
    "greatest",
    "log32",
    "total_of",
    "warm",
    "weighted",
    "weighted_product",
]

Array = NDArray[Any]

Word = Any  # of LLVM: a builder, a value, a type
Term = Callable[..., Word]
_slot: Term = cgutils.alloca_once_value

LANES, STREAMS = 8, 4  # of a vector, and vectors that are summed side by side
_FLOATS = types.Array(types.float32, 1, "C")

_F0, _F05, _F1 = np.float32(0.0), np.float32(0.5), np.float32(1.0)
_LOWEST = np.float32(-87.0)
_LOG2E = np.float32(1.44269504)
_LN2_HIGH, _LN2_LOW = np.float32(0.693359375), np.float32(-2.12194440e-4)
_LN2 = np.float32(0.69314718)
_EXP = tuple(np.float32(c) for c in (1.0, 0.5, 1.0 / 6.0, 1.0 / 24.0, 1.0 / 120.0, 1.0 / 720.0))
# Odd series of 2 atanh(t) = log((1 + t)/(1 - t)); |t| <= 0.172, so the rest is below 1e-8.
_LOG = tuple(np.float32(2.0 / n) for n in (1, 3, 5, 7, 9))


@njit(cache=True, error_model="numpy", inline="always")
def exp32(x: np.float32) -> np.float32:
    """Exponential of a float32 in [-87, 0] (less counts as -87), relative error below 3e-7."""
    x = max(x, _LOWEST)
    k = np.floor(x * _LOG2E + _F05)
    f = (x - k * _LN2_HIGH) - k * _LN2_LOW
    p = _EXP[0] + f * (_EXP[1] + f * (_EXP[2] + f * (_EXP[3] + f * (_EXP[4] + f * _EXP[5]))))
    power = np.int32((np.int32(k) + np.int32(127)) << np.int32(23)).view(np.float32)
    result: np.float32 = (_F1 + f * p) * power
    return result


@njit(cache=True, error_model="numpy", inline="always")
def log32(x: np.float32) -> np.float32:
    """Natural logarithm of a positive normal float32, error below 2e-7 of it or of 1."""
    raw = np.float32(x).view(np.int32)
    # x = 2^exponent * mantissa by bits, mantissa in [sqrt(1/2), sqrt(2)).
    exponent = (raw - np.int32(0x3F3504F3)) >> np.int32(23)
    mantissa = np.int32(raw - (exponent << np.int32(23))).view(np.float32)
    t = (mantissa - _F1) / (mantissa + _F1)
    t2 = t * t
    log = t * (_LOG[0] + t2 * (_LOG[1] + t2 * (_LOG[2] + t2 * (_LOG[3] + t2 * _LOG[4]))))
    result: np.float32 = log + np.float32(exponent) * _LN2
    return result


def _fold(
    builder: Word,
    made: Sequence[Word],
    scalars: Sequence[Word],
    term: Term,
    join: Term,
    start: float,
) -> Word:
    """``join`` of a term of all elements: in `STREAMS` vectors of `LANES`, then one, then singly.

    The order stands in the program, so that it is the same on every processor.
    """
    single, vector = ir.FloatType(), ir.VectorType(ir.FloatType(), LANES)
    size, index = made[0].nitems, made[0].nitems.type
    splat = [_splat(builder, vector, scalar) for scalar in scalars]
    streams = [_slot(builder, vector([start] * LANES)) for _ in range(STREAMS)]
    rest = _slot(builder, single(start))

    def take(
        first: Word, last: Word, kind: Word, given: Sequence[Word], totals: Sequence[Word]
    ) -> None:
        width = LANES if kind is vector else 1
        step = index(width * len(totals))
        with cgutils.for_range_slice(builder, first, last, step, index) as (i, _):
            for k, total in enumerate(totals):
                at = builder.add(i, index(k * width))
                places = [builder.gep(array.data, [at]) for array in made]
                typed = [builder.bitcast(place, kind.as_pointer()) for place in places]
                elements = [builder.load(place, align=4) for place in typed]
                value = term(builder, *elements, *given)
                builder.store(join(builder, builder.load(total), value), total)

    by_streams = builder.and_(size, index(-STREAMS * LANES))
    by_lanes = builder.and_(size, index(-LANES))
    take(index(0), by_streams, vector, splat, streams)
    take(by_streams, by_lanes, vector, splat, streams[:1])
    take(by_lanes, size, single, scalars, [rest])
    both = partial(join, builder)
    together = reduce(both, [builder.load(stream) for stream in streams])
    lanes = [builder.extract_element(together, ir.IntType(32)(lane)) for lane in range(LANES)]
    while len(lanes) > 1:
        half = len(lanes) // 2
        lanes = list(map(both, lanes[:half], lanes[half:]))
    return both(lanes[0], builder.load(rest))


def _splat(builder: Word, vector: Word, scalar: Word) -> Word:
    """A vector whose elements are all the scalar."""
    empty, first = ir.Constant(vector, ir.Undefined), ir.IntType(32)(0)
    mask = ir.Constant(ir.VectorType(ir.IntType(32), LANES), [0] * LANES)
    return builder.shuffle_vector(builder.insert_element(empty, scalar, first), empty, mask)


def _generator(arrays: int, term: Term, join: Term, start: float) -> Term:
    """What writes the program of a fold over so many arrays, and of scalars after them."""

    def generate(context: Word, builder: Word, signature: Word, arguments: Word) -> Word:
        made = [
            context.make_array(kind)(context, builder, value)
            for kind, value in zip(signature.args[:arrays], arguments, strict=False)
        ]
        return _fold(builder, made, arguments[arrays:], term, join, start)

    return generate


def _add(builder: Word, a: Word, b: Word) -> Word:
    return builder.fadd(a, b)


def _more(builder: Word, a: Word, b: Word) -> Word:
    return builder.select(builder.fcmp_ordered(">", b, a), b, a)


def _itself(builder: Word, a: Word) -> Word:
    return a


def _product(builder: Word, a: Word, b: Word) -> Word:
    return builder.fmul(a, b)


def _moment(builder: Word, w: Word, a: Word, b: Word, about_a: Word, about_b: Word) -> Word:
    return builder.fmul(w, builder.fmul(builder.fsub(a, about_a), builder.fsub(b, about_b)))


def _total(context: object, values: object) -> object:
    return types.float32(_FLOATS), _generator(1, _itself, _add, 0.0)


def _greatest(context: object, values: object) -> object:
    return types.float32(_FLOATS), _generator(1, _itself, _more, -math.inf)


def _weighted(context: object, weights: object, values: object) -> object:
    return types.float32(_FLOATS, _FLOATS), _generator(2, _product, _add, 0.0)


def _weighted_product(
    context: object, weights: object, a: object, b: object, about_a: object, about_b: object
) -> object:
    single = types.float32
    kinds = (_FLOATS, _FLOATS, _FLOATS, single, single)
    return single(*kinds), _generator(3, _moment, _add, 0.0)


total_of = cast(Callable[[Array], float], intrinsic(_total))
"""``total_of(values)``: sum of a contiguous float32 array."""

greatest = cast(Callable[[Array], np.float32], intrinsic(_greatest))
"""``greatest(values)``: greatest of a contiguous float32 array without NaN; of none -inf."""

weighted = cast(Callable[[Array, Array], float], intrinsic(_weighted))
"""``weighted(weights, values)``: sum of the products of two contiguous float32 arrays."""

weighted_product = cast(
    Callable[[Array, Array, Array, np.float32, np.float32], float], intrinsic(_weighted_product)
)
"""``weighted_product(w, a, b, about_a, about_b)``: sum of ``w (a - about_a) (b - about_b)``."""


def warm() -> None:
    """Compile, or load from the cache, what is called from Python in a flight: nothing."""
