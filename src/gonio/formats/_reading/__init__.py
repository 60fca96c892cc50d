"""What readers and writers of many formats share: text, JSON, HDF, tensor files, large tables, pipes, channels."""
