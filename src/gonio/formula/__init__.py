"""What a formula is written with: directions, declared parameters, special functions, pieces of microfacet models."""
