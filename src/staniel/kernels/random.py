"""Random numbers as pure functions of a key and counters: explicit streams, no state to carry.

A draw is ``mix(key + (counter + 1) * golden)``, the SplitMix64 sequence (Steele, Lea and Flood
2014) read at any place. A key comes from the scenario's `numpy.random.SeedSequence`; who draws and
when are the counters, so one entity's draws never depend on how many others there are.
"""

import numpy as np
from numba import njit
from numpy.typing import NDArray

__all__ = ["bits", "fold", "normals", "uniform", "warm"]

_GOLDEN = np.uint64(0x9E3779B97F4A7C15)
_MIX_1 = np.uint64(0xBF58476D1CE4E5B9)
_MIX_2 = np.uint64(0x94D049BB133111EB)
_ONE = np.uint64(1)
_S11, _S27, _S30, _S31, _S32, _S40 = (np.uint64(n) for n in (11, 27, 30, 31, 32, 40))
_LOW_32 = np.uint64(0xFFFFFFFF)
_TWO_53 = 1.0 / 9007199254740992.0
_TWO_24 = np.float32(1.0 / 16777216.0)
_F0, _F05, _F1, _F2 = np.float32(0.0), np.float32(0.5), np.float32(1.0), np.float32(2.0)
_SQRT_HALF = np.float32(0.70710678)
_LN2 = np.float32(0.69314718)
_HALF_PI = np.float32(1.57079633)
# Odd series of 2 atanh(t) = log((1 + t)/(1 - t)); |t| <= 0.172, so the rest is below 1e-8.
_LOG = tuple(np.float32(2.0 / n) for n in (1, 3, 5, 7, 9))
# Taylor series of sin and cos on |a| <= pi/4; the rest is below 4e-8.
_SIN = tuple(np.float32(c) for c in (1.0, -1.0 / 6.0, 1.0 / 120.0, -1.0 / 5040.0))
_COS = tuple(np.float32(c) for c in (1.0, -0.5, 1.0 / 24.0, -1.0 / 720.0, 1.0 / 40320.0))


@njit(cache=True, error_model="numpy", inline="always")
def bits(key: np.uint64, counter: np.uint64) -> np.uint64:
    """64 random bits, the draw number `counter` of the stream `key` (both uint64)."""
    z = key + (counter + _ONE) * _GOLDEN
    z = (z ^ (z >> _S30)) * _MIX_1
    z = (z ^ (z >> _S27)) * _MIX_2
    return z ^ (z >> _S31)


@njit(cache=True, error_model="numpy")
def fold(key: np.uint64, counter: int) -> np.uint64:
    """Key of the sub-stream `counter` of the stream `key`."""
    return bits(bits(key, np.uint64(counter)), np.uint64(0))


@njit(cache=True, error_model="numpy")
def uniform(key: np.uint64, counter: int) -> float:
    """One number in [0, 1), 53 bits of it random."""
    return np.float64(bits(key, np.uint64(counter)) >> _S11) * _TWO_53


@njit(cache=True, error_model="numpy")
def normals(key: np.uint64, first: int, out: NDArray[np.float32]) -> None:
    """Fill a flat float32 array of even length with standard normals: Box-Muller, branch-free.

    One 64-bit draw gives a pair: 32 bits the radius, 24 bits the angle. The radius resolution
    bounds the tail at 6.7 standard deviations. Polynomials instead of library calls, so that it
    vectorises.

    Parameters
    ----------
    key : uint64
        The stream.
    first : int
        Counter of the first pair; ``len(out) // 2`` counters are used.
    out : (2 n,) float32 array
        First halves of the pairs in ``out[:n]``, second halves in ``out[n:]``.
    """
    half = out.size // 2
    start = np.uint64(first)
    for i in range(half):
        z = bits(key, start + np.uint64(i))
        # (0, 1]: the logarithm stays finite. 2^-32 steps hold the tail to 6.7 sigma.
        unit = np.float32(np.float64(np.int64(z >> _S32) + 1) * (1.0 / 4294967296.0))
        # unit = 2^exponent * mantissa by bits, mantissa in [sqrt(1/2), sqrt(2)).
        raw = unit.view(np.int32)
        exponent = (raw - np.int32(0x3F3504F3)) >> np.int32(23)
        mantissa = np.int32(raw - (exponent << np.int32(23))).view(np.float32)
        t = (mantissa - _F1) / (mantissa + _F1)
        t2 = t * t
        log = t * (_LOG[0] + t2 * (_LOG[1] + t2 * (_LOG[2] + t2 * (_LOG[3] + t2 * _LOG[4]))))
        log += np.float32(exponent) * _LN2
        radius = np.sqrt(max(_F0, -_F2 * log))
        # Angle = quarter turn number + a, |a| <= pi/4.
        turn = np.float32(np.int32((z & _LOW_32) >> np.uint64(8))) * _TWO_24
        quarter = np.int32(turn * np.float32(4.0) + _F05)
        a = (turn * np.float32(4.0) - np.float32(quarter)) * _HALF_PI
        a2 = a * a
        sin = a * (_SIN[0] + a2 * (_SIN[1] + a2 * (_SIN[2] + a2 * _SIN[3])))
        cos = _COS[0] + a2 * (_COS[1] + a2 * (_COS[2] + a2 * (_COS[3] + a2 * _COS[4])))
        odd = (quarter & np.int32(1)) == np.int32(1)
        sign_cos = _F1 - np.float32((quarter + np.int32(1)) & np.int32(2))
        sign_sin = _F1 - np.float32(quarter & np.int32(2))
        out[i] = radius * sign_cos * (sin if odd else cos)
        out[half + i] = radius * sign_sin * (cos if odd else sin)


def warm() -> None:
    """Compile, or load from the cache, what is called from Python in a flight."""
    uniform(np.uint64(fold(np.uint64(0), 0)), 0)
