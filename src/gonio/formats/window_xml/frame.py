"""A new file of WINDOW's XML: what stands around the numbers."""

from __future__ import annotations

from collections.abc import Sequence
from xml.sax.saxutils import escape

from .klems import AngleBasis

DETECTORS = {"Visible": "ASTM E308 1931 Y.dsp", "CIE-X": "ASTM E308 1931 X.dsp", "CIE-Z": "ASTM E308 1931 Z.dsp"}

_START = """<?xml version="1.0" encoding="UTF-8"?>
<WindowElement xmlns="http://windows.lbl.gov" xmlns:xsi="http://www.w3.org/2001/XMLSchema-instance" \
xsi:schemaLocation="http://windows.lbl.gov/BSDF-v1.4.xsd">
<WindowElementType>System</WindowElementType>
<FileType>BSDF</FileType>
<Optical>
<Layer>
	<Material>
		<Name>{name}</Name>
		<Manufacturer>gonio</Manufacturer>
		<DeviceType>Other</DeviceType>
	</Material>
	<DataDefinition>
		<IncidentDataStructure>{structure}</IncidentDataStructure>
{bases}	</DataDefinition>
"""

_BASIS = """		<AngleBasis>
			<AngleBasisName>{name}</AngleBasisName>
{rings}		</AngleBasis>
"""

_RING = """			<AngleBasisBlock>
				<Theta>{theta!r}</Theta>
				<nPhis>{count}</nPhis>
				<ThetaBounds><LowerTheta>{low!r}</LowerTheta><UpperTheta>{high!r}</UpperTheta></ThetaBounds>
			</AngleBasisBlock>
"""

_BLOCK = """	<WavelengthData>
		<LayerNumber>System</LayerNumber>
		<Wavelength unit="{unit}">{band}</Wavelength>
{spectra}		<WavelengthDataBlock>
			<WavelengthDataDirection>{direction}</WavelengthDataDirection>
{over}			<ScatteringDataType>BTDF</ScatteringDataType>
			<ScatteringData>"""

_AFTER = """</ScatteringData>
		</WavelengthDataBlock>
	</WavelengthData>
"""

_END = """</Layer>
</Optical>
</WindowElement>
"""


def around(
    bands: Sequence[tuple[str, str]],
    structure: str,
    direction: str,
    name: str,
    incident: AngleBasis | None,
    outgoing: AngleBasis | None,
) -> list[str]:
    """The pieces before, between and after the numbers of bands, each (name, unit or "" of an integral)."""
    bases = "".join(_defined(basis) for basis in dict.fromkeys((incident, outgoing)) if basis is not None)
    if incident is None or outgoing is None:
        over = "\t\t\t<AngleBasis>LBNL/Shirley-Chiu</AngleBasis>\n"
    else:
        over = f"\t\t\t<ColumnAngleBasis>{escape(incident.name)}</ColumnAngleBasis>\n"
        over += f"\t\t\t<RowAngleBasis>{escape(outgoing.name)}</RowAngleBasis>\n"
    starts = [
        _BLOCK.format(unit=u or "Integral", band=b, spectra=_spectra(b), direction=direction, over=over)
        for b, u in bands
    ]
    pieces = [_START.format(name=escape(name or "BRDF"), structure=structure, bases=bases) + starts[0]]
    pieces += [_AFTER + start for start in starts[1:]]
    return [*pieces, _AFTER + _END]


def _spectra(band: str) -> str:
    if band not in DETECTORS:
        return ""
    detector = f"\t\t<DetectorSpectrum>{DETECTORS[band]}</DetectorSpectrum>\n"
    return "\t\t<SourceSpectrum>CIE Illuminant D65 1nm.ssp</SourceSpectrum>\n" + detector


def _defined(basis: AngleBasis) -> str:
    rings = zip(basis.edges, basis.edges[1:], basis.counts, strict=False)
    middle = [
        0.0 if low == 0.0 and n == 1 else 0.5 * (low + high)
        for low, high, n in zip(basis.edges, basis.edges[1:], basis.counts, strict=False)
    ]
    text = "".join(
        _RING.format(theta=theta, count=count, low=float(low), high=float(high))
        for theta, (low, high, count) in zip(middle, rings, strict=True)
    )
    return _BASIS.format(name=escape(basis.name), rings=text)
