"""How a formula meets arrays: traced, planned and compiled, or run on arrays as it stands."""
