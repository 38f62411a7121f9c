"""Reads the XML documents of the System Structure and Parameterization standard (SSP 1.0 and 2.0) safely.

Entities are not expanded, document type declarations are refused, nothing is fetched.
"""

from collections.abc import Iterator, Set
from typing import Any

from lxml import etree

from .problems import Place, Problems

NAMESPACES = frozenset(
    f"http://ssp-standard.org/SSP1/SystemStructure{part}"
    for part in ("Common", "Description", "ParameterValues", "ParameterMapping", "SignalDictionary")
)
"""Namespaces of SSP, the same in both versions."""
ANNOTATION = "org.twip.cosim"
"""Type of the annotation by which a file proposes a coupling and a step size."""
OMSIMULATOR = "org.openmodelica"
"""Type of OMSimulator's annotations; it takes the type and the step of a system from there."""
_OMSIMULATOR_STEP = (
    "{https://raw.githubusercontent.com/OpenModelica/OMSimulator/master/schema/oms.xsd}SimulationInformation"
)
_INSTANCE_NAMESPACE = "{http://www.w3.org/2001/XMLSchema-instance}"
MAXIMUM_BYTES = 64 * 1024 * 1024
BASE_ATTRIBUTES = frozenset({"id", "description"})
METADATA_ATTRIBUTES = frozenset(
    {"author", "fileversion", "copyright", "license", "generationTool", "generationDateAndTime"}
)

IGNORED_WITH_WARNING = frozenset({"MetaData", "Signature"})
"""Elements of SSP 2.0 that a tool may ignore; `warn_of_ignored` names them, as it does annotations."""

Element = etree._Element


def parse_xml(data: bytes, file: str, problems: Problems) -> Element | None:
    """Parse `data`; a malformed, oversized or entity-carrying document is a problem and gives None."""
    if len(data) > MAXIMUM_BYTES:
        problems.add(f"{file}: larger than {MAXIMUM_BYTES // 1024 // 1024} MiB, refused")
        return None
    parser = etree.XMLParser(
        resolve_entities=False, no_network=True, load_dtd=False, dtd_validation=False, huge_tree=False
    )
    try:
        root = etree.fromstring(data, parser)
    except (etree.XMLSyntaxError, ValueError, UnicodeError) as error:
        reason = getattr(error, "msg", None) or str(error)  # lxml appends the place to the latter
        problems.add(f"not well-formed XML: {reason}", Place(file, getattr(error, "lineno", None)))
        return None
    information: Any = root.getroottree().docinfo
    if information.doctype:
        problems.add("a document type declaration is not allowed", Place(file))
        return None
    return root


def name_of(element: Element) -> str:
    """Return the local name of an SSP element, and `{namespace}name` of a foreign one."""
    name = etree.QName(element)
    return name.localname if name.namespace in NAMESPACES else element.tag


def ssp_name(element: Element) -> str:
    """Return `name_of` an element, and of one without a namespace what is no name in SSP."""
    return name_of(element) if etree.QName(element).namespace else f"{element.tag} without a namespace"


def _proposes_twice(annotation: Element) -> bool:
    """Tell whether an annotation for OMSimulator only says how it is to step what the document tells us how to step."""
    parts = [part for group in annotation.iterchildren("{*}*") for part in group.iterchildren("{*}*")]
    ours = any(other.get("type") == ANNOTATION for other in annotation.getroottree().iter("{*}Annotation"))
    return ours and bool(parts) and all(part.tag == _OMSIMULATOR_STEP for part in parts)


class Reader:
    """Walks a document, naming everything that the caller neither reads nor may ignore."""

    def __init__(self, file: str, problems: Problems):
        self.file = file
        self.problems = problems

    def place(self, element: Element) -> Place:
        """Where `element` stands."""
        line: Any = element.sourceline
        return Place(self.file, line)

    def children(self, element: Element, read: Set[str], ignored: Set[str] = frozenset()) -> Iterator[Element]:
        """Yield the children named in `read`; those in `ignored` have no effect on a run; others are problems."""
        for child in element:
            if not isinstance(child.tag, str):
                continue
            name = ssp_name(child)
            if name in read:
                yield child
            elif name not in {"Annotations", *ignored, *IGNORED_WITH_WARNING}:
                self.problems.add(f"{name} in {name_of(element)} is not supported", self.place(child))

    def leaf(self, element: Element, known: Set[str]) -> None:
        """Report every attribute that is not `known`, as `attributes` does, and every child."""
        self.attributes(element, known)
        for _ in self.children(element, set()):
            pass

    def warn_of_ignored(self, element: Element, proposing: bool) -> None:
        """Name everything inside `element` that a tool may ignore and this one does, wherever it stands: annotations of
        others, meta data, signatures. Our own annotations have a meaning in a `proposing` document only. One that
        has them may propose a step to OMSimulator too: nothing is lost.
        """
        for child in element.iterchildren("{*}*"):
            name = name_of(child)
            if name == "Annotations":
                for annotation in self.children(child, {"Annotation"}):
                    kind = self.required(annotation, "type")
                    if kind == OMSIMULATOR and proposing and _proposes_twice(annotation):
                        continue
                    if kind != ANNOTATION:
                        self.problems.warn(f"annotations of type {kind} are ignored", self.place(annotation))
                    elif not proposing:
                        self.problems.add(f"annotation {ANNOTATION} has no meaning here", self.place(annotation))
            elif name in IGNORED_WITH_WARNING:
                self.problems.warn(f"{name} of {name_of(element)} is ignored", self.place(child))
            else:
                self.warn_of_ignored(child, proposing)

    def child(self, element: Element, name: str) -> Element | None:
        """Return the child called `name`; a second one is a problem."""
        found = [child for child in element if isinstance(child.tag, str) and ssp_name(child) == name]
        for more in found[1:]:
            self.problems.add(f"{name_of(element)} has more than one {name}", self.place(more))
        return found[0] if found else None

    def listed(self, element: Element, container: str, read: Set[str]) -> Iterator[Element]:
        """Yield the children named in `read` of the child called `container`, if there is one; it has no attributes."""
        found = self.child(element, container)
        if found is not None:
            self.attributes(found, set())
            yield from self.children(found, read)

    def attributes(self, element: Element, known: Set[str]) -> None:
        """Report every attribute that is neither in `known` nor purely descriptive."""
        for attribute in element.attrib:
            text = str(attribute)
            if text not in known and text not in BASE_ATTRIBUTES and not text.startswith(_INSTANCE_NAMESPACE):
                self.problems.add(f"attribute {text} of {name_of(element)} is not supported", self.place(element))

    def required(self, element: Element, attribute: str) -> str:
        """Return an attribute that must be there and not empty."""
        value = element.get(attribute)
        if not value:
            self.problems.add(f"{name_of(element)} has no {attribute}", self.place(element))
        return value or ""

    def number(self, element: Element, attribute: str, default: float | None = None) -> float | None:
        """Return an attribute as a finite number."""
        text = element.get(attribute)
        if text is None:
            return default
        try:
            value = float(text) if text.isascii() and "_" not in text else float("nan")
        except ValueError:
            value = float("nan")
        if value - value != 0.0:
            self.problems.add(
                f"{attribute} = {text!r} of {name_of(element)}", self.place(element), rule="must be a finite number"
            )
            return default
        return value

    def integer(self, element: Element, attribute: str) -> int | None:
        """Return an attribute that must be a whole number of at most 64 bits; None when it is not."""
        text = self.required(element, attribute).strip()
        digits = text.removeprefix("-").removeprefix("+")
        if text and not (digits.isascii() and digits.isdigit() and len(digits) < 21 and -(2**63) <= int(text) < 2**64):
            self.problems.add(
                f"{attribute} = {text!r} of {name_of(element)}", self.place(element), rule="must be a whole number"
            )
            return None
        return int(text) if text else None

    def boolean(self, element: Element, attribute: str) -> bool:
        """Return an XML boolean attribute, False when missing."""
        text = element.get(attribute, "false").strip()
        if text not in ("true", "false", "1", "0"):
            self.problems.add(
                f"{attribute} = {text!r} of {name_of(element)}", self.place(element), rule="must be true or false"
            )
        return text in ("true", "1")
