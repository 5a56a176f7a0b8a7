"""Sines, cosines and arc tangents that vectorise: polynomials without branches and library calls.

LLVM turns a loop over these functions into vector instructions; a call of the C library in its
place would hold up the whole loop. Each product and sum of a polynomial is one fused operation, so
that a result is the same to the last bit in a vector loop, in its remainder, and on any processor;
one without such an instruction, older than about 2013, is slow here but not different.
"""

import math
from collections.abc import Callable
from typing import Any, cast

import numpy as np
from numba import njit, types
from numba.extending import intrinsic

__all__ = ["atan2", "cosines", "from_half_turns", "from_turns", "fused"]

# sin r = r + r³ S(r²) and cos r = 1 - r²/2 + r⁴ C(r²) on |r| <= pi/2, atan r = r + r³ A(r²) on
# |r| <= tan(pi/8) = sqrt(2) - 1: interpolated at Chebyshev nodes, relative errors below 4e-17.
_SIN = (
    -0.16666666666666666, 0.008333333333333316, -0.00019841269841254966, 2.7557319219160833e-06,
    -2.505210761669045e-08, 1.6058977292642743e-10, -7.643969663988074e-13, 2.7314368769379893e-15,
)  # fmt: skip
_COS = (
    0.041666666666666664, -0.001388888888888888, 2.4801587301579848e-05, -2.755731922156836e-07,
    2.0876756602722215e-09, -1.1470712262813793e-11, 4.77787760803859e-14, -1.5218598818596388e-16,
)  # fmt: skip
_ATAN = (
    -0.3333333333333333, 0.19999999999995519, -0.14285714284666184, 0.11111111015227572,
    -0.09090904576954117, 0.07692183163650894, -0.06664511064599371, 0.05858145587628202,
    -0.050854323376990765, 0.0392311556198723, -0.01917627151752634,
)  # fmt: skip

_PI, _HALF_PI, _QUARTER_PI = math.pi, math.pi / 2.0, math.pi / 4.0
_DIAGONAL = math.sqrt(2.0) - 1.0
# Pi in three parts: products of the first two with whole numbers below 2**20 are exact.
_PI_1 = float.fromhex("0x1.921fb54400000p+1")
_PI_2 = float.fromhex("0x1.0b4611a600000p-33")
_PI_3 = float.fromhex("0x1.3198a2e037073p-68")
_TINY = 1e-300


def _fused(context: object, a: object, b: object, c: object) -> object:
    def generate(context: object, builder: Any, signature: object, arguments: Any) -> object:  # noqa: ANN401
        return builder.fma(*arguments)

    return types.float64(types.float64, types.float64, types.float64), generate


fused = cast(Callable[[float, float, float], float], intrinsic(_fused))
"""``fused(a, b, c)`` is ``a b + c``, rounded once."""


@njit(cache=True, error_model="numpy", forceinline=True)
def from_half_turns(angle: float) -> tuple[float, float]:
    """An angle of up to 1e6 rad as (k, r): ``k pi + r`` with a whole k and |r| <= pi/2."""
    k = np.floor(angle * (1.0 / _PI) + 0.5)
    return k, ((angle - k * _PI_1) - k * _PI_2) - k * _PI_3


@njit(cache=True, error_model="numpy", forceinline=True)
def from_turns(angle: float) -> float:
    """An angle of up to 1e6 rad less the whole circles nearest to it: in [-pi, pi]."""
    k: float = 2.0 * np.floor(angle * (0.5 / _PI) + 0.5)
    return ((angle - k * _PI_1) - k * _PI_2) - k * _PI_3


@njit(cache=True, error_model="numpy", forceinline=True)
def cosines(r: float) -> tuple[float, float]:
    """Cosine and sine of an angle in [-pi/2, pi/2], to 3e-16 of one."""
    z = r * r
    w = z * z
    # Odd and even powers in two chains, for they wait for each other less.
    odd = fused(fused(fused(_SIN[7], w, _SIN[5]), w, _SIN[3]), w, _SIN[1])
    even = fused(fused(fused(_SIN[6], w, _SIN[4]), w, _SIN[2]), w, _SIN[0])
    sine = fused(fused(odd, z, even), z * r, r)
    odd = fused(fused(fused(_COS[7], w, _COS[5]), w, _COS[3]), w, _COS[1])
    even = fused(fused(fused(_COS[6], w, _COS[4]), w, _COS[2]), w, _COS[0])
    return fused(fused(odd, z, even), w, fused(-0.5, z, 1.0)), sine


@njit(cache=True, error_model="numpy", forceinline=True)
def atan2(y: float, x: float) -> float:
    """Angle of the vector (x, y) in [-pi, pi], to two units in the last place; 0 of no vector."""
    short, long = min(abs(x), abs(y)), max(abs(x), abs(y))
    # Beyond 22.5 degrees from the nearest axis the angle is taken from the diagonal. Every choice
    # is one of a number or 0: a mask in a vector.
    far = short > _DIAGONAL * long
    r = (short - (long if far else 0.0)) / max(long + (short if far else 0.0), _TINY)
    z = r * r
    w = z * z
    v = w * w
    low = fused(fused(_ATAN[3], z, _ATAN[2]), w, fused(_ATAN[1], z, _ATAN[0]))
    middle = fused(fused(_ATAN[7], z, _ATAN[6]), w, fused(_ATAN[5], z, _ATAN[4]))
    high = fused(_ATAN[10], w, fused(_ATAN[9], z, _ATAN[8]))
    angle = fused(fused(fused(high, v, middle), v, low), z * r, r)
    angle += _QUARTER_PI if far else 0.0
    angle = abs(angle - (_HALF_PI if abs(y) > abs(x) else 0.0))
    angle = abs(angle - (_PI if x < 0.0 else 0.0))
    return math.copysign(angle, y)
