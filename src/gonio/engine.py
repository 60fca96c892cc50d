"""What runs a formula: its compiled kernel, its source text for shaders and other programs, the threads."""

from .declared.namespace import on_use

__getattr__, __dir__, __all__ = on_use(
    __name__,
    {
        "kernel": "facts.compiled",
        "shader_source": "bridges.source",
        "threads": "compile.threads",
    },
)
