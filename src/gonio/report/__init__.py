"""What there is to know about a material, as facts, tables and figures."""
