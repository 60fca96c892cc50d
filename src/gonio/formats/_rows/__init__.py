"""What formats share that hold rows of measurements: pairs of directions and values."""
