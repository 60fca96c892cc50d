"""Shared by readers and writers of many formats: text, JSON, HDF, tensor files, large tables, pipes, channels."""
