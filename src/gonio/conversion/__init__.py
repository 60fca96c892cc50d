"""From one format, or from any reflectance, to a table or a file, with what that costs."""
