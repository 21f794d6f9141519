"""OpenCV's XML storage (``<opencv_storage>``) as the mapping that its YAML storage would be."""

from xml.etree import ElementTree as ET

from .errors import FormatError


def parse_opencv_xml(text: str, name: str) -> dict[object, object]:
    """Return the entries of an OpenCV storage; matrices as ``{rows, cols, data}``, numbers as text.

    Raises:
        FormatError: it is no XML, no OpenCV storage, or it defines entities (which could expand without
        bound).
    """
    if "<!DOCTYPE" in text or "<!ENTITY" in text:
        raise FormatError(f"{name}: defines XML entities. Name a plain OpenCV storage file.")
    try:
        root = ET.fromstring(text)  # noqa: S314 - no entities: checked above
    except ET.ParseError as err:
        raise FormatError(f"{name}:{err.position[0]}: is no XML ({err}). Correct the line.") from err
    if root.tag != "opencv_storage":
        raise FormatError(f"{name}: is <{root.tag}>, not <opencv_storage>. Name a file that OpenCV wrote.")
    return {child.tag: _value(child) for child in root}


def _value(element: ET.Element) -> object:
    if element.get("type_id") == "opencv-matrix":
        return {"data": (element.findtext("data") or "").split()}
    return (element.text or "").strip()
