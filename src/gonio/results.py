"""Classes of what functions and methods return, for annotations and `isinstance`: nobody calls these."""

from .declared.namespace import on_use

__getattr__, __dir__, __all__ = on_use(
    __name__,
    {
        "Conversion": "conversion.conversion",
        "Fate": "integrals.fate",
        "Fit": "fitting.result",
        "FitMap": "fitting.maps.maps",
        "HalfDifferenceAngles": "base.frames",
        "Kernel": "facts.compiled",
        "KernelFit": "remote_sensing.fitting",
        "Matches": "reconstruction.nearness",
        "PhotometricStereo": "fitting.maps.photometric_stereo",
        "PictureDifference": "pictures.difference",
        "Plan": "reconstruction.planning.plan",
        "Problem": "fitting.problem",
        "Quoted": "uncertainty.quoted",
        "Radiosity": "interreflection.result",
        "Reconstruction": "reconstruction.posterior",
        "ReflectanceBasis": "reconstruction.basis",
        "Repair": "base.history",
        "Report": "laws",
        "RetroFacets": "reconstruction.retro",
        "Sample": "base.results",
        "Selection": "fitting.selection",
        "ShaderSource": "bridges.source",
        "Simulated": "instrument.measure",
        "StokesPicture": "scenes.stokes",
        "TablePlan": "reconstruction.planning.table_plan",
        "TexelData": "fitting.maps.texel_data",
    },
)
