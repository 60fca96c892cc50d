"""Tables and facets from values, without a formula for f: bases of materials, retro-reflection."""
