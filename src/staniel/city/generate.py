"""A believable city from a few numbers: bent streets, and blocks that are not all alike.

Streets run between the nodes of an uneven grid; the nodes are moved a little, so streets bend. Some
neighbouring blocks grow together, so streets end at them. Inside its four corners a block is laid
out in coordinates (u, v) in the unit square, whose straight lines stay straight on the ground.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import shapely
from numpy.typing import NDArray

from staniel.city.checks import check_height_range, check_seed, number_pair
from staniel.errors import CityError

__all__ = ["generate_outlines"]

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

_NARROWEST = 6.3  # nominal width of a street or alley: 6 m remain where it bends [m]
_ALLEY = 7.0  # widest alley [m]
_DENSEST = 0.8
_MATCH = 0.008  # how well the density is met; 0.01 is promised
_CLOSE = 0.0005  # where the search for the street width stops
_MOST_BLOCKS = 20_000
_BEND = 0.06  # how far a street node moves, share of the shortest block side
_JOINED = 0.12  # share of blocks that grow together with a neighbour
_PARK = 0.04  # share of blocks that are not built on
_ROOMY = 25.0  # shortest block side that leaves room for alleys and courts [m]

# Shares of the block layouts, where there is room for air and where there is not.
_KINDS = ("solid", "row", "alley", "alley and row", "corner", "court")
_AIRY = (0.14, 0.20, 0.18, 0.16, 0.16, 0.16)
_COMPACT = (0.40, 0.60, 0.0, 0.0, 0.0, 0.0)


@dataclass(frozen=True)
class _Plan:
    """Every random choice of a city; only the street width and the share of air are left open.

    Attributes
    ----------
    n_blocks : (int, int)
        East and north.
    sizes, streets : pair of float arrays
        Draws in [0, 1] for the block sides and, around 1, for the street widths, each direction.
    bends : (nx + 1, ny + 1, 2) float array
        How the street nodes move, in [-1, 1].
    airy, compact : (nx, ny) int array
        Index into `_KINDS`, with and without alleys and courts.
    ranks : (2, nx, ny) float array
        In [0, 1): which blocks lose their air first, and which become parks first.
    joined : (nx, ny) int array
        0 alone, 1 with the block east of it, 2 with the one north, -1 and -2 the other halves.
    draws : (nx, ny, 6) float array
        In [0, 1), what a layout needs.
    """

    n_blocks: tuple[int, int]
    sizes: tuple[Floats, Floats]
    streets: tuple[Floats, Floats]
    bends: Floats
    airy: Ints
    compact: Ints
    ranks: Floats
    joined: Ints
    draws: Floats

    def kinds(self, air: float) -> Ints:
        """(nx, ny) layouts, -1 for a park: all compact at 0, all airy at 1, all parks at 2."""
        kinds = np.where(self.ranks[0] < air, self.airy, self.compact)
        parks = _PARK + (1.0 - _PARK) * (air - 1.0) if air >= 1.0 else _PARK * air
        return np.where(self.ranks[1] < parks, -1, kinds)


def generate_outlines(
    size: tuple[float, float],
    density: float,
    block: tuple[float, float],
    heights: tuple[float, float],
    seed: int,
) -> tuple[list[shapely.Polygon], Floats]:
    """Outlines and roof heights of a generated city; see `City.generate`."""
    low, high = check_height_range(heights)
    sides = number_pair("block", block, "two numbers of metres, shortest <= longest side")
    if not 10.0 <= sides[0] <= sides[1]:
        raise CityError(f"block: expected metres 10 <= shortest <= longest side, got {block!r}")
    if not (isinstance(density, int | float) and 0.0 < density <= _DENSEST):
        raise CityError(f"density: expected a number in (0, {_DENSEST}], got {density!r}")
    seed = check_seed(seed)
    if size[0] * size[1] / (sides[0] * sides[1]) > _MOST_BLOCKS:
        raise CityError(
            f"size: expected at most {_MOST_BLOCKS} blocks of {sides[0]:g} to {sides[1]:g} m, "
            f"got {size[0]:g} x {size[1]:g} m"
        )
    nearest = math.inf
    candidates = _candidates(size, density, sides)
    for fixed_air in (True, False):
        for n_blocks in candidates:
            rng = np.random.default_rng(seed)
            plan = _draw(rng, n_blocks, sides)
            pieces, reached = _solve(plan, size, sides, density, fixed_air)
            if pieces and abs(reached - density) <= min(_MATCH, 0.5 * density):
                roofs = rng.uniform(low, high, len(pieces))
                return [shapely.Polygon(piece) for piece in pieces], roofs
            if pieces and abs(reached - density) < abs(nearest - density):
                nearest = reached
    got = f"nearest is {nearest:.3f}" if candidates else "not one block fits"
    raise CityError(
        f"density: expected what {size[0]:g} x {size[1]:g} m hold in blocks of {sides[0]:g} to "
        f"{sides[1]:g} m with streets of at least 6 m around each ({got}), got {density!r}"
    )


def _candidates(
    size: tuple[float, float], density: float, sides: tuple[float, float]
) -> list[tuple[int, int]]:
    """Numbers of blocks east and north that may reach the density, the likeliest first."""
    side = 0.5 * (sides[0] + sides[1])
    most = [int((extent - _NARROWEST) / (sides[0] + _NARROWEST)) for extent in size]
    ranked = []
    for nx in range(1, most[0] + 1):
        # As many north as give streets of the same width.
        street = (size[0] - nx * side) / (nx + 1)
        ideal = (size[1] - street) / (side + street)
        for ny in {math.floor(ideal), math.ceil(ideal)}:
            if 1 <= ny <= most[1]:
                built = 0.9 * nx * ny * side * side / (size[0] * size[1])
                ranked.append((abs(built - density), nx, ny))
    return [(nx, ny) for _, nx, ny in sorted(ranked)[:12]]


def _draw(rng: np.random.Generator, n_blocks: tuple[int, int], sides: tuple[float, float]) -> _Plan:
    nx, ny = n_blocks
    compact = rng.choice(len(_KINDS), size=(nx, ny), p=_COMPACT)
    airy = rng.choice(len(_KINDS), size=(nx, ny), p=_AIRY)
    joined = np.zeros((nx, ny), dtype=np.int64)
    for i, j in np.ndindex(nx, ny):
        east = bool(rng.random() < 0.5)
        wanted = bool(rng.random() < _JOINED)
        i2, j2 = (i + 1, j) if east else (i, j + 1)
        if wanted and i2 < nx and j2 < ny and not (joined[i, j] or joined[i2, j2]):
            joined[i, j], joined[i2, j2] = (1, -1) if east else (2, -2)
    streets = []
    for n in n_blocks:
        widths = rng.uniform(0.4, 1.6, n + 1)
        streets.append(widths / widths.mean())
    return _Plan(
        n_blocks=n_blocks,
        sizes=(rng.random(nx), rng.random(ny)),
        streets=(streets[0], streets[1]),
        bends=rng.uniform(-1.0, 1.0, (nx + 1, ny + 1, 2)),
        airy=airy if sides[0] >= _ROOMY else compact,
        compact=compact,
        ranks=rng.random((2, nx, ny)),
        joined=joined,
        draws=rng.random((nx, ny, 6)),
    )


def _solve(
    plan: _Plan,
    size: tuple[float, float],
    sides: tuple[float, float],
    density: float,
    fixed_air: bool,
) -> tuple[list[Floats], float]:
    """Buildings that come nearest to the density, and what they reach.

    First by the mean street width; where that is not enough and it is allowed, at the narrowest
    or widest streets by the share of air.
    """
    bend = min(_BEND * sides[0], 0.12 * (sides[1] - sides[0]))
    inner = (sides[0] + 2.0 * bend, sides[1] - 2.0 * bend)
    spans = [
        (max(_NARROWEST, (extent - n * inner[1]) / (n + 1)), (extent - n * inner[0]) / (n + 1))
        for n, extent in zip(plan.n_blocks, size, strict=True)
    ]
    if any(narrow > wide for narrow, wide in spans):
        return [], 0.0

    def build(street: float, air: float) -> tuple[list[Floats], float]:
        widths = [min(max(street, narrow), wide) for narrow, wide in spans]
        pieces = _buildings(plan, size, inner, bend, widths, air)
        return pieces, sum(map(_area, pieces)) / (size[0] * size[1])

    narrow, wide = min(s[0] for s in spans), max(s[1] for s in spans)
    pieces, reached = _searched(lambda street: build(street, 1.0), narrow, wide, density)
    if fixed_air or abs(reached - density) <= _MATCH:
        return pieces, reached
    if reached < density:
        return _searched(lambda air: build(narrow, air), 0.0, 1.0, density)
    return _searched(lambda air: build(wide, air), 1.0, 2.0, density)


def _searched(
    build: Callable[[float], tuple[list[Floats], float]], low: float, high: float, density: float
) -> tuple[list[Floats], float]:
    """The nearest that `build`, whose density falls with its argument, comes to the density.

    Straight lines between what is known at both ends, kept off the ends so that both move in.
    """
    best, other = build(low), build(high)
    at_low, at_high = best[1], other[1]
    if abs(at_high - density) < abs(at_low - density):
        best = other
    for _ in range(24):
        if abs(best[1] - density) <= _CLOSE or not at_low > density > at_high:
            break
        share = min(max((at_low - density) / (at_low - at_high), 0.1), 0.9)
        middle = low + share * (high - low)
        built = build(middle)
        if abs(built[1] - density) < abs(best[1] - density):
            best = built
        if built[1] > density:
            low, at_low = middle, built[1]
        else:
            high, at_high = middle, built[1]
    return best


def _buildings(
    plan: _Plan,
    size: tuple[float, float],
    inner: tuple[float, float],
    bend: float,
    widths: list[float],
    air: float,
) -> list[Floats]:
    """Outlines (n, 2), counter-clockwise, for given mean street widths and share of air."""
    (x, half_x), (y, half_y) = (
        _street_lines(extent, width, share, sizes, inner)
        for extent, width, share, sizes in zip(size, widths, plan.streets, plan.sizes, strict=True)
    )
    nodes = np.stack(np.meshgrid(x, y, indexing="ij"), axis=-1) + bend * plan.bends
    nodes[[0, -1], :, 0] = np.array([0.0, size[0]])[:, None]
    nodes[:, [0, -1], 1] = np.array([0.0, size[1]])
    kinds = plan.kinds(air)
    pieces: list[Floats] = []
    for i, j in np.ndindex(*plan.n_blocks):
        if kinds[i, j] < 0:
            continue
        joined = int(plan.joined[i, j])
        west = 0.0 if joined == -1 else half_x[i]
        east = 0.0 if joined == 1 else half_x[i + 1]
        south = 0.0 if joined == -2 else half_y[j]
        north = 0.0 if joined == 2 else half_y[j + 1]
        corners = np.array([nodes[i, j], nodes[i + 1, j], nodes[i + 1, j + 1], nodes[i, j + 1]])
        corners += np.array([[west, south], [-east, south], [-east, -north], [west, -north]])
        # The longer side is cut; a joined block keeps its openings away from the seam.
        longer_north = bool(plan.sizes[1][j] > plan.sizes[0][i])
        turned = abs(joined) == 2 or (joined == 0 and longer_north)
        kind = _KINDS[kinds[i, j]]
        # A cut corner at the seam would leave a niche that no vehicle fits into.
        if kind == "solid" and joined != 0:
            shapes = [_box(0.0, 1.0, 0.0, 1.0)]
        else:
            shapes = _layout(kind, corners, turned, plan.draws[i, j])
        pieces.extend(_on_ground(corners, shape) for shape in shapes)
    return pieces


def _street_lines(
    extent: float, width: float, share: Floats, sizes: Floats, inner: tuple[float, float]
) -> tuple[Floats, Floats]:
    """Middle of each street across one direction, and from there to the block beside it [m].

    The first and the last line are the city's edge; the whole street lies inside of it.
    """
    streets = _NARROWEST + (width - _NARROWEST) * share
    mean = (extent - streets.sum()) / len(sizes)
    # The draws, pulled towards 0 or 1 until the blocks fill what the streets leave.
    target = min(max((mean - inner[0]) / max(inner[1] - inner[0], 1e-9), 0.0), 1.0)
    average = sizes.mean()
    if target > average:
        pulled = sizes + (1.0 - sizes) * (target - average) / (1.0 - average)
    else:
        pulled = sizes * target / average
    blocks = inner[0] + (inner[1] - inner[0]) * pulled
    blocks *= (extent - streets.sum()) / blocks.sum()
    starts = np.cumsum(streets) + np.concatenate([[0.0], np.cumsum(blocks)])
    lines, halves = starts - 0.5 * streets, 0.5 * streets
    lines[0], lines[-1] = 0.0, extent
    halves[0], halves[-1] = streets[0], streets[-1]
    return lines, halves


def _layout(kind: str, corners: Floats, turned: bool, draws: Floats) -> list[Floats]:
    """Buildings of one block in its own coordinates, u along east and v along north.

    Drawn with its cuts across u, and with a `turned` block's axes exchanged.
    """
    along = min(math.dist(corners[0], corners[1]), math.dist(corners[3], corners[2]))
    across = min(math.dist(corners[0], corners[3]), math.dist(corners[1], corners[2]))
    length, depth = (across, along) if turned else (along, across)
    alley = (_NARROWEST + (_ALLEY - _NARROWEST) * draws[0]) / length
    cut = 0.36 + 0.28 * draws[1]
    other = 0.36 + 0.28 * draws[2]
    if kind == "solid":
        shapes = [_chamfered(0.0, 1.0, draws, length, depth)]
    elif kind == "row":
        shapes = [_box(0.0, cut, 0.0, 1.0), *_stack(cut, 1.0, other, draws[3] < 0.5)]
    elif kind == "alley":
        shapes = [_box(0.0, cut - alley / 2, 0.0, 1.0), _box(cut + alley / 2, 1.0, 0.0, 1.0)]
    elif kind == "alley and row":
        shapes = [
            *_stack(0.0, cut - alley / 2, other, True),
            *_stack(cut + alley / 2, 1.0, 1.0 - other, draws[3] < 0.5),
        ]
    elif kind == "corner":
        shapes = [_corner(0.40 + 0.2 * draws[1], 0.40 + 0.2 * draws[2])]
    else:
        shapes = [_court(0.28 + 0.06 * draws[1], 0.66 + 0.06 * draws[2], 0.35 + 0.1 * draws[3])]
    if draws[4] < 0.5:
        shapes = [np.column_stack([shape[:, 0], 1.0 - shape[:, 1]])[::-1] for shape in shapes]
    if draws[5] < 0.5:
        shapes = [np.column_stack([1.0 - shape[:, 0], shape[:, 1]])[::-1] for shape in shapes]
    return [shape[::-1, ::-1] for shape in shapes] if turned else shapes


def _box(u0: float, u1: float, v0: float, v1: float) -> Floats:
    return np.array([[u0, v0], [u1, v0], [u1, v1], [u0, v1]])


def _stack(u0: float, u1: float, v: float, split: bool) -> list[Floats]:
    """One house, or two wall to wall."""
    if not split:
        return [_box(u0, u1, 0.0, 1.0)]
    return [_box(u0, u1, 0.0, v), _box(u0, u1, v, 1.0)]


def _chamfered(u0: float, u1: float, draws: Floats, length: float, depth: float) -> Floats:
    """A house with one corner cut off, as at many crossings."""
    u, v = (3.0 + 4.0 * draws[1]) / length, (3.0 + 4.0 * draws[1]) / depth
    return np.array([[u0 + u, 0.0], [u1, 0.0], [u1, 1.0], [u0, 1.0], [u0, v]])


def _corner(u: float, v: float) -> Floats:
    """Two wings and an open place at the corner."""
    return np.array([[0.0, 0.0], [1.0, 0.0], [1.0, v], [u, v], [u, 1.0], [0.0, 1.0]])


def _court(u0: float, u1: float, v: float) -> Floats:
    """Three wings around a court that is open on one side."""
    return np.array([
        [0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [u1, 1.0], [u1, v], [u0, v], [u0, 1.0], [0.0, 1.0],
    ])  # fmt: skip


def _on_ground(corners: Floats, shape: Floats) -> Floats:
    """Bilinear map of the unit square onto the block: lines of constant u or v stay straight."""
    u, v = shape[:, :1], shape[:, 1:]
    south = corners[0] + u * (corners[1] - corners[0])
    north = corners[3] + u * (corners[2] - corners[3])
    ground: Floats = south + v * (north - south)
    return ground


def _area(ring: Floats) -> float:
    x, y = ring[:, 0], ring[:, 1]
    inner = x[:-1] @ y[1:] - y[:-1] @ x[1:]
    return 0.5 * float(inner + x[-1] * y[0] - y[-1] * x[0])
