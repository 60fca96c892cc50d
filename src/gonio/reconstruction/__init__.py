"""Tables and facets from values, without a formula for f: bases of materials, retro-reflection."""

from ..declared.namespace import on_use

__getattr__, __dir__, __all__ = on_use(
    __name__,
    {
        "photometric_stereo": "fitting.maps.photometric_stereo",
        "texel_data": "fitting.maps.texel_data",
        "nearest": "reconstruction.nearness",
        "reconstruct": "reconstruction.reconstructing",
        "reflectance_basis": "reconstruction.reconstructing",
        "retro_facets": "reconstruction.retro",
    },
)
