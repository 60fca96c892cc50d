"""The language of formulas: directions, declared parameters, special functions, pieces of microfacet models."""
