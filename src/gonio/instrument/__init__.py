"""The virtual gonioreflectometer: rays on a surface, facet to facet, until they leave it and are counted."""
