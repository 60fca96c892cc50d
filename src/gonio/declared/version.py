"""The version of gonio."""

__version__ = "0.1.0"
