"""What can be said of materials, models and formats, as data: no markup, nothing printed."""
