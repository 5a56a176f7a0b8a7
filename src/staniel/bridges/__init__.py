"""Words of other libraries for ours, one module a library: `staniel.bridges.stonesoup`."""
