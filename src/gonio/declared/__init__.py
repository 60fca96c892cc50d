"""What signatures, docstrings and folders declare, read once: arguments, tables of contents, what notebooks show."""
