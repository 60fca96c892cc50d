"""Which directions to measure: goniometers, plans for models and for tables."""
