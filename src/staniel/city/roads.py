"""A network of roads that traffic may follow."""

from dataclasses import dataclass
from os import PathLike
from typing import TYPE_CHECKING

import numpy as np
import shapely
from numpy.typing import NDArray

from staniel.city.features import Feature, Origin, frame_of, positions, read_features
from staniel.errors import CityError

if TYPE_CHECKING:
    from staniel.city.city import City

__all__ = ["RoadNetwork"]

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Bools = NDArray[np.bool_]

_MERGE = 0.5  # vertices nearer than this are one junction [m]
_TOUCHING = 1e-6  # a road may have so much of itself in common with a building [m]
_OPPOSITE = -0.9  # cosine of the angle between two directions that are opposite
_SIDE_BY_SIDE = 15.0  # roads that run so far beside one another do so on purpose [m]
_MOST_VERTICES = 1_000_000
_LINES = ("LineString", "MultiLineString")
_FALSE = frozenset({"no", "false", "0", "none", ""})


@dataclass(frozen=True, eq=False)
class RoadNetwork:
    """Straight pieces of road between nodes.

    Attributes
    ----------
    nodes : (n, 2) float array [m]
        East and north of the scenario. No two are nearer than half a metre, where they come from
        a file.
    edges : (m, 2) int array
        Of each piece the node it starts from and the one it leads to; never the same, and no two
        pieces join the same two nodes.
    both_ways : (m,) bool array
        False where the piece may be driven only from its first node to its second.

    Examples
    --------
    >>> net = RoadNetwork(
    ...     nodes=np.array([[0.0, 0.0], [30.0, 40.0]]),
    ...     edges=np.array([[0, 1]]),
    ...     both_ways=np.array([True]),
    ... )
    >>> net.lengths
    array([50.])
    """

    nodes: Floats
    edges: Ints
    both_ways: Bools

    @classmethod
    def from_geojson(
        cls,
        path: str | PathLike[str],
        *,
        city: "City | None" = None,
        origin: Origin | None = None,
        frame: str = "auto",
    ) -> "RoadNetwork":
        """Roads from the LineStrings and MultiLineStrings of a GeoJSON file.

        Roads in a `tunnel` are left out; `oneway` is kept ("-1" turns the road round). Vertices
        nearer than half a metre become one node, so roads that share a vertex meet there.

        Parameters
        ----------
        path : path
            At most 256 MB, 500 000 features and a million vertices.
        city : City, optional
            Its origin is taken; it must have come from a GeoJSON file, in the same frame.
        origin : Origin, optional
            Place of the scenario's origin in the file's frame. With neither: the south-west corner
            of the roads.
        frame : {"auto", "wgs84", "metres"}
            Of the coordinates where neither `city` nor `origin` tells it.

        Raises
        ------
        CityError
            A file that is missing, too large or not GeoJSON; no road in it, or none near the
            city; a city without an origin.
        """
        if origin is None and city is not None:
            origin = getattr(city, "origin", None)
            if origin is None:
                raise CityError(
                    f"{path}: roads need a city that was read from GeoJSON, or an origin"
                )
        lines, both_ways = _lines(path)
        points = np.concatenate(lines)
        if origin is None:
            try:
                found = frame_of(points, frame)
            except CityError as error:
                raise CityError(f"{path}: {error}") from None
            corner = points.min(axis=0).tolist()
            origin = Origin(found, corner[0], corner[1])
        local = origin.to_local(points)
        if city is not None and not ((local >= 0.0) & (local <= city.size)).all(axis=1).any():
            raise CityError(
                f"{path}: expected roads in the city's rectangle, got no vertex of them there; the "
                f"city's coordinates were taken as {origin.frame}"
            )
        return cls(*_joined(local, [len(line) for line in lines], both_ways))

    @property
    def lengths(self) -> Floats:
        """(m,) length of each piece [m]."""
        along = self.nodes[self.edges[:, 1]] - self.nodes[self.edges[:, 0]]
        lengths: Floats = np.hypot(along[:, 0], along[:, 1])
        return lengths

    def clear_of(self, city: "City", radius: float = 0.0) -> "RoadNetwork":
        """The roads that can be driven in a city.

        Parameters
        ----------
        city : City
        radius : float [m]
            Of a vehicle in the middle of the road, at least 0.

        Returns
        -------
        RoadNetwork
            Without the pieces that leave the city's rectangle, cross or follow a building or come
            nearer than `radius` to one, reduced to the part of greatest length in which every node
            can be reached from every other. Without nodes, where there is no such part.
        """
        starts, ends = self.nodes[self.edges[:, 0]], self.nodes[self.edges[:, 1]]
        clear = np.ones(len(self.edges), dtype=np.bool_)
        low, high = np.full(2, radius), np.asarray(city.size) - radius
        for corner in (starts, ends):
            clear &= (corner >= low).all(axis=1) & (corner <= high).all(axis=1)
        outlines = np.array(city.outlines, dtype=object)
        tree = shapely.STRtree(outlines)
        pieces = np.asarray(shapely.linestrings(np.stack([starts, ends], axis=1)))
        if radius > 0.0:
            near = tree.query(pieces, predicate="dwithin", distance=radius)[0]
        else:
            # Crossing a corner is no harm, running along a wall is: two houses may share it.
            near, building = tree.query(pieces, predicate="intersects")
            common = shapely.intersection(pieces[near], outlines[building])
            near = near[shapely.length(common) > _TOUCHING]
        clear[near] = False
        return self._part(clear)._connected()

    def without_head_on(self, offset: float, width: float) -> "RoadNetwork":
        """The directions that can be driven at once where roads run side by side.

        Two roads that lie nearer together than their lanes need are the two halves of one: on each
        only the direction stays that has the other half to its left.

        Parameters
        ----------
        offset : float [m]
            At which one drives to the right of a road's middle, at least 0.
        width : float [m]
            Nearer than that two lanes lie on one another.

        Returns
        -------
        RoadNetwork
            Without the directions of which more than half, and more than 15 m, lies on a lane that
            leads the opposite way, reduced as by `clear_of`.
        """
        back = np.flatnonzero(self.both_ways)
        ways = np.concatenate([self.edges, self.edges[back, ::-1]])
        road = np.concatenate([np.arange(len(self.edges)), back])
        starts, ends = self.nodes[ways[:, 0]], self.nodes[ways[:, 1]]
        along = (ends - starts) / self.lengths[road, None]
        right = offset * np.stack([along[:, 1], -along[:, 0]], axis=1)
        lanes = np.asarray(shapely.linestrings(np.stack([starts + right, ends + right], axis=1)))
        a, b = shapely.STRtree(lanes).query(lanes, predicate="dwithin", distance=width)
        against = (road[a] != road[b]) & ((along[a] * along[b]).sum(axis=1) < _OPPOSITE)
        a, b = a[against], b[against]
        common = shapely.intersection(lanes[a], shapely.buffer(lanes[b], width, cap_style="flat"))
        shared = np.bincount(a, weights=shapely.length(common), minlength=len(ways))
        free = (shared < _SIDE_BY_SIDE) | (shared < 0.5 * self.lengths[road])
        forth, other = free[: len(self.edges)], np.zeros(len(self.edges), dtype=np.bool_)
        other[back] = free[len(self.edges) :]
        edges = np.where(forth[:, None], self.edges, self.edges[:, ::-1])
        return RoadNetwork(self.nodes, edges, forth & other)._part(forth | other)._connected()

    def without_stubs(self, length: float, apart: float) -> "RoadNetwork":
        """Without dead ends in which one would turn round in a junction or on another road.

        Parameters
        ----------
        length : float [m]
            At least so far from the end of a dead end to the first junction.
        apart : float [m]
            At least so far from there to any other road.

        Returns
        -------
        RoadNetwork
            Where what one dead end leaves is another, without that, too.
        """
        pieces = np.asarray(shapely.linestrings(self.nodes[self.edges]))
        tree, lengths = shapely.STRtree(pieces), self.lengths
        keep = np.ones(len(self.edges), dtype=np.bool_)
        at: list[list[int]] = [[] for _ in self.nodes]
        for edge, (a, b) in enumerate(self.edges.tolist()):
            at[a].append(edge)
            at[b].append(edge)
        tips = [node for node, edges in enumerate(at) if len(edges) == 1]
        while tips:
            tip = node = tips.pop()
            stub = list[int]()
            while len(onward := [edge for edge in at[node] if edge not in stub[-1:]]) == 1:
                stub += onward
                node = int(self.edges[onward[0]].sum()) - node
                if len(at[node]) > 2:
                    break
            if len(at[node]) < 3:
                continue  # a road without a junction
            near = tree.query(shapely.points(self.nodes[tip]), predicate="dwithin", distance=apart)
            if lengths[stub].sum() < length or (keep[near] & ~np.isin(near, stub)).any():
                keep[stub] = False
                at[node].remove(stub[-1])
        return self._part(keep)

    def _connected(self) -> "RoadNetwork":
        """The strongly connected part of greatest length."""
        from scipy import sparse  # takes a while to import, and few cities have roads

        n = len(self.nodes)
        back = self.edges[self.both_ways][:, ::-1]
        ways = np.concatenate([self.edges, back])
        graph = sparse.coo_array((np.ones(len(ways)), (ways[:, 0], ways[:, 1])), shape=(n, n))
        part = sparse.csgraph.connected_components(graph, connection="strong")[1]
        first, second = part[self.edges[:, 0]], part[self.edges[:, 1]]
        within = first == second
        if not within.any():
            return self._part(within)
        metres = np.bincount(first[within], weights=self.lengths[within], minlength=n)
        return self._part(within & (first == metres.argmax()))

    def _part(self, keep: Bools) -> "RoadNetwork":
        """Only these pieces, and the nodes that they have."""
        used, edges = np.unique(self.edges[keep], return_inverse=True)
        return RoadNetwork(
            np.ascontiguousarray(self.nodes[used]),
            np.ascontiguousarray(edges.reshape(-1, 2).astype(np.int64)),
            np.ascontiguousarray(self.both_ways[keep]),
        )


def _lines(path: str | PathLike[str]) -> tuple[list[Floats], list[bool]]:
    """Every road of a file in its direction of travel, and whether it goes both ways."""
    lines: list[Floats] = []
    both_ways: list[bool] = []
    n_vertices = 0
    for feature in read_features(path, "GeoJSON with roads as LineStrings"):
        if _said(feature, "tunnel") not in _FALSE:
            continue
        oneway = _said(feature, "oneway")
        try:
            for coordinates in feature.parts(_LINES):
                line = positions(coordinates)
                if not np.isfinite(line).all():
                    raise CityError("expected finite coordinates")
                n_vertices += len(line)
                if len(line) >= 2:
                    lines.append(line[::-1] if oneway in ("-1", "reverse") else line)
                    both_ways.append(oneway in _FALSE)
        except CityError as error:
            raise CityError(f"{path}: feature {feature.number}: {error}") from None
        if n_vertices > _MOST_VERTICES:
            raise CityError(f"{path}: expected roads of at most {_MOST_VERTICES:,} vertices")
    if not lines:
        raise CityError(f"{path}: expected roads as LineStrings, got none")
    return lines, both_ways


def _said(feature: Feature, key: str) -> str:
    """A property as lower-case text; nothing, null and false are ''."""
    value = feature.properties.get(key)
    return "" if value is None or value is False else str(value).strip().lower()


def _joined(points: Floats, counts: list[int], both_ways: list[bool]) -> tuple[Floats, Ints, Bools]:
    """Nodes, edges and whether they go both ways, from all lines' vertices in turn."""
    nodes, node = _merged(points)
    line = np.repeat(np.arange(len(counts)), counts)
    step = np.flatnonzero((line[1:] == line[:-1]) & (node[1:] != node[:-1]))
    edges = np.column_stack([node[step], node[step + 1]])
    both = np.asarray(both_ways, dtype=np.bool_)[line[step]]
    # Of pieces between the same two nodes one is kept; together they may go both ways.
    low_first = np.sort(edges, axis=1)
    _, first, which = np.unique(low_first, axis=0, return_index=True, return_inverse=True)
    which = which.reshape(-1)
    against = (edges != edges[first[which]]).any(axis=1)
    free = np.zeros(len(first), dtype=np.bool_)
    np.logical_or.at(free, which, both | against)
    order = np.sort(first)
    free = free[np.argsort(first)]
    return nodes, np.ascontiguousarray(edges[order], dtype=np.int64), free


def _merged(points: Floats) -> tuple[Floats, Ints]:
    """The nodes, and of each vertex its node: the nearest earlier one within reach, or a new one.

    Nodes stay apart, so that few of them lie in one square of the hash: the cost grows with the
    vertices, however they crowd.
    """
    squares: dict[tuple[int, int], list[int]] = {}
    nodes: list[tuple[float, float]] = []
    node = np.empty(len(points), dtype=np.int64)
    for k, (x, y) in enumerate(points.tolist()):
        i, j = int(x // _MERGE), int(y // _MERGE)
        nearest, reach = -1, _MERGE * _MERGE
        for a in (i - 1, i, i + 1):
            for b in (j - 1, j, j + 1):
                for m in squares.get((a, b), ()):
                    far = (nodes[m][0] - x) ** 2 + (nodes[m][1] - y) ** 2
                    if far < reach:
                        nearest, reach = m, far
        if nearest < 0:
            nearest = len(nodes)
            nodes.append((x, y))
            squares.setdefault((i, j), []).append(nearest)
        node[k] = nearest
    return np.array(nodes, dtype=np.float64).reshape(-1, 2), node
