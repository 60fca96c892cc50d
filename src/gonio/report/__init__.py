"""Pages about materials, and what notebooks show of objects."""
