"""Hot paths: `@njit` functions of arrays, and nothing of ours above them."""
