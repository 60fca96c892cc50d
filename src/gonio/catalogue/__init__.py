"""Materials by name and by text, and where each is from."""
