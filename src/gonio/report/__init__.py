"""Facts, tables and figures about materials and formats."""
