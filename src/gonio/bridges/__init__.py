"""Bridges to other libraries, one file each; nothing here is imported unless asked for by name."""
