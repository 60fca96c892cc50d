"""Any reflectance as a table, or as a file of another format, with the error of the conversion."""
