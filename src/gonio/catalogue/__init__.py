"""Built-in materials, material expressions, and citations."""
