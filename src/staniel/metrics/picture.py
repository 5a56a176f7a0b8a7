"""The team picture: what the aircraft believe together, one estimate for each track."""

import numpy as np
from numpy.typing import NDArray

__all__ = ["freshest", "id_codes", "team_picture"]


def id_codes(ids: NDArray[np.str_]) -> NDArray[np.int64]:
    """Number track ids 0, 1, ... in the order of their first appearance.

    Parameters
    ----------
    ids : (n,) array of str

    Returns
    -------
    (n,) int array

    Examples
    --------
    >>> id_codes(np.array(["2-0", "0-0", "2-0"]))
    array([0, 1, 0])
    """
    numbers: dict[str, int] = {}
    return np.array([numbers.setdefault(name, len(numbers)) for name in ids.tolist()], np.int64)


def team_picture(tracks: NDArray[np.void]) -> NDArray[np.intp]:
    """Choose one estimate for each track id and instant: the freshest that any agent holds.

    All agents' rows of one instant are grouped by the track's id. Of each group the row with the
    newest ``last_seen`` stands for the team; of equally fresh ones that of the lowest agent. This
    is what an onlooker who hears every aircraft would draw; no agent need hold it.

    Parameters
    ----------
    tracks : (n,) array of `staniel.record.TRACK_DTYPE`
        Of one instant or of many.

    Returns
    -------
    (m,) int array
        The chosen rows, in the order of time, then of the id's first appearance.

    Examples
    --------
    Two agents hold track 0-0, the second saw it later:

    >>> from staniel.record import TRACK_DTYPE
    >>> tracks = np.zeros(2, TRACK_DTYPE)
    >>> tracks["agent"], tracks["id"], tracks["last_seen"] = [0, 1], "0-0", [3.0, 5.0]
    >>> team_picture(tracks)
    array([1])
    """
    return freshest(tracks, id_codes(tracks["id"]))


def freshest(tracks: NDArray[np.void], codes: NDArray[np.int64]) -> NDArray[np.intp]:
    """`team_picture` of tracks whose ids are numbered already, by `id_codes`."""
    times = tracks["time"]
    order = np.lexsort((tracks["agent"], -tracks["last_seen"], codes, times))
    first = np.ones(len(order), dtype=bool)
    sorted_codes, sorted_times = codes[order], times[order]
    first[1:] = (sorted_codes[1:] != sorted_codes[:-1]) | (sorted_times[1:] != sorted_times[:-1])
    return order[first]
