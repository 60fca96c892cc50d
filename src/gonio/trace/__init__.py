"""Formulas as graphs: operations on symbols are recorded, merged, differentiated, shown and evaluated."""
