"""The array libraries, a file each with a `LIBRARY`: found by being here."""
