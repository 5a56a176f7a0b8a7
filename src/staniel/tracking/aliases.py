"""One name for one target in the whole team, without anybody who decides."""

from collections.abc import Collection, Iterable

from staniel.datatypes.belief import TrackId

__all__ = ["Aliases"]

_AGREED = 3  # reports in a row


class Aliases:
    """Learns from what others call the tracks that they share, and takes over the older name.

    A report tells by which name its sender knows what it saw. Where the receiver gives the sighting
    to a track of another name, both mean the same target, if that happens several reports in a row.
    The older of the two names is kept; as everybody keeps the oldest that it hears of, and names
    are told again and again, all that hear one another, directly or not, end with the same name,
    whatever is lost, repeated or comes late.
    """

    def __init__(self) -> None:
        # By sender and own name: the sender's name, how often in a row, and of when the last was.
        self._heard: dict[tuple[int, TrackId], tuple[TrackId, int, float]] = {}

    def step(
        self,
        reports: Iterable[tuple[int, float, TrackId, TrackId]],
        live: Collection[TrackId],
        held: Collection[TrackId] = (),
    ) -> list[tuple[TrackId, TrackId]]:
        """Take in what was heard in a step.

        Parameters
        ----------
        reports : iterable of (int, float, TrackId, TrackId)
            Sender, time [s], the own name and the sender's name of what caused one sighting.
        live : collection of TrackId
            The own tracks' names.
        held : collection of TrackId, optional
            Names that are not to change: a holder's name rules.

        Returns
        -------
        list of (TrackId, TrackId)
            Own names, and the older ones to take over. Never a name that another own track has.
        """
        names, renames = set(live), []
        self._heard = {key: value for key, value in self._heard.items() if key[1] in names}
        for sender, time, own, theirs in sorted(reports):
            known, count, last = self._heard.get((sender, own), (theirs, 0, -1e300))
            if time <= last:
                continue
            count = count + 1 if known == theirs else 1
            self._heard[sender, own] = theirs, count, time
            if (
                count >= _AGREED
                and theirs < own
                and own in names
                and own not in held
                and theirs not in names
            ):
                renames.append((own, theirs))
                names = (names - {own}) | {theirs}
        return renames
