"""The languages, one file each: `LANGUAGE` says how it writes what a graph holds."""
