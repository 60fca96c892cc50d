"""Formulas as graphs: what is done to symbols is recorded, merged, differentiated, shown and evaluated again."""
