"""What readers and writers of many formats share: text, HDF, JSON, pipes, options."""
