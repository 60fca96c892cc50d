"""Pictures: arrays of pixels, their files, and colour."""
