"""A fit at every texel: maps, chunks of maps on clusters, images under known lights."""
