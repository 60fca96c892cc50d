"""Lit shapes as pictures."""

from ..declared.namespace import on_use

__getattr__, __dir__, __all__ = on_use(
    __name__,
    {
        "radiosity": "interreflection.solving",
        "picture_difference": "pictures.difference",
        "Image": "pictures.image",
        "load_image": "pictures.image",
        "Camera": "scenes.camera",
        "OrthographicCamera": "scenes.camera",
        "View": "scenes.camera",
        "picture_jacobian": "scenes.jacobian",
        "Mesh": "scenes.mesh",
        "render_stokes": "scenes.stokes",
        "write_turntable": "scenes.turntable",
    },
)
