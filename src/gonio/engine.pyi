"""What runs a formula: its compiled kernel, its source text for shaders and other programs, the threads."""

from .bridges.source import shader_source as shader_source
from .compile.threads import threads as threads
from .facts.compiled import kernel as kernel
