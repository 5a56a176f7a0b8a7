"""Before anything is called: no compiled kernel that is older than its sources."""

from staniel.kernels.cache import drop_stale

drop_stale()
