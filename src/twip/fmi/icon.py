"""The icon of an FMU where each version of FMI looks for it."""

from pathlib import Path

from lxml import etree

_SIDE = {"x1": "-100", "y1": "-100", "x2": "100", "y2": "100"}


def icon_files(face: Path, version: str) -> dict[str, bytes]:
    """Return path in the FMU → content for the picture `model.png` beside a face; nothing where there is none.

    FMI 2.0 has it as `model.png` (FMI 2.0.4, section 2.3), FMI 3.0 as `terminalsAndIcons/icon.png` with a description
    of its place in a diagram (FMI 3.0.1, section 2.5).
    """
    icon = face.with_name("model.png")
    if not icon.is_file():
        return {}
    if version == "2.0":
        return {"model.png": icon.read_bytes()}
    root = etree.Element("fmiTerminalsAndIcons", {"fmiVersion": version})
    picture = etree.SubElement(root, "GraphicalRepresentation")
    etree.SubElement(picture, "CoordinateSystem", {**_SIDE, "suggestedScalingFactorTo_mm": "0.1"})
    etree.SubElement(picture, "Icon", _SIDE)
    etree.indent(root)
    xml: bytes = etree.tostring(root, xml_declaration=True, encoding="UTF-8")
    folder = "terminalsAndIcons"
    return {f"{folder}/icon.png": icon.read_bytes(), f"{folder}/{folder}.xml": xml + b"\n"}
