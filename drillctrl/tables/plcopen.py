"""Function blocks and programs as PLCopen XML, TC6 2.01, from their Structured Text."""

from __future__ import annotations

import re
from xml.etree import ElementTree

_SPACE = "http://www.plcopen.org/xml/tc6_0201"
_PAGE = "http://www.w3.org/1999/xhtml"
_SECTIONS = {
    "VAR_INPUT": ("inputVars", {}),
    "VAR_OUTPUT": ("outputVars", {}),
    "VAR": ("localVars", {}),
    "VAR CONSTANT": ("localVars", {"constant": "true"}),
}
_KINDS = {"FUNCTION_BLOCK": "functionBlock", "PROGRAM": "program"}
_UNIT = re.compile(r"^(FUNCTION_BLOCK|PROGRAM) (\w+)\n(.*?)^END_\1$", re.DOTALL | re.MULTILINE)
_SECTION = re.compile(
    r"^(VAR(?:_INPUT|_OUTPUT| CONSTANT)?)\n(.*?)^END_VAR$", re.DOTALL | re.MULTILINE
)
_VARIABLE = re.compile(
    r"^    (\w+) : (?:ARRAY\[0\.\.(\d+)\] OF )?(\w+)"
    r"(?: := (\[.*?\]|[^;]+))?;(?: \(\* (.*?) \*\))?$",
    re.DOTALL | re.MULTILINE,
)
_ELEMENTARY = ("BOOL", "DINT", "LREAL")
# The standard wants a time; the same table is to make the same bytes.
_TIME = "2000-01-01T00:00:00"


def plcopen_text(name: str, texts: list[str]) -> str:
    """Return a project that holds what texts declare.

    Parameters
    ----------
    name : str
        Of the project.
    texts : list of str
        Structured Text as this package writes it, of one function block or program each, with
        a comment before it.
    """
    ElementTree.register_namespace("", _SPACE)
    ElementTree.register_namespace("xhtml", _PAGE)
    root = _element("project")
    told = {"companyName": "drillctrl", "productName": "drillctrl", "productVersion": "1"}
    root.append(_element("fileHeader", **told, creationDateTime=_TIME))
    content = _element("contentHeader", name=name, modificationDateTime=_TIME)
    root.append(content)
    coordinates = _element("coordinateInfo")
    content.append(coordinates)
    for language in ("fbd", "ld", "sfc"):
        place = _element(language)
        place.append(_element("scaling", x="1", y="1"))
        coordinates.append(place)
    types = _element("types")
    root.append(types)
    types.append(_element("dataTypes"))
    units = _element("pous")
    types.append(units)
    for text in texts:
        units.append(_unit(text))
    instances = _element("instances")
    instances.append(_element("configurations"))
    root.append(instances)
    ElementTree.indent(root)
    return '<?xml version="1.0" encoding="utf-8"?>\n' + ElementTree.tostring(root, "unicode") + "\n"


def _element(tag: str, **attributes: str) -> ElementTree.Element:
    return ElementTree.Element(f"{{{_SPACE}}}{tag}", attributes)


def _page(text: str) -> ElementTree.Element:
    found = ElementTree.Element(f"{{{_PAGE}}}p")
    found.text = text
    return found


def _unit(text: str) -> ElementTree.Element:
    """Return the element of a function block or program."""
    found = _UNIT.search(text)
    assert found is not None
    kind, name, inner = found.groups()
    unit = _element("pou", name=name, pouType=_KINDS[kind])
    interface = _element("interface")
    unit.append(interface)
    end = 0
    for section in _SECTION.finditer(inner):
        tag, given = _SECTIONS[section[1]]
        variables = _element(tag, **given)
        for variable in _VARIABLE.finditer(section[2]):
            variables.append(_variable(*variable.groups()))
        interface.append(variables)
        end = section.end()
    body = _element("body")
    unit.append(body)
    language = _element("ST")
    body.append(language)
    page = _page(f"\n{text[: found.start()].strip()}\n{inner[end:].strip()}\n")
    language.append(page)
    return unit


def _variable(
    name: str, last: str | None, kind: str, start: str | None, words: str | None
) -> ElementTree.Element:
    variable = _element("variable", name=name)
    place = _element("type")
    variable.append(place)
    if last is not None:
        array = _element("array")
        place.append(array)
        array.append(_element("dimension", lower="0", upper=last))
        place = _element("baseType")
        array.append(place)
    place.append(_element(kind) if kind in _ELEMENTARY else _element("derived", name=kind))
    if start is not None:
        value = _element("initialValue")
        variable.append(value)
        if last is None:
            value.append(_element("simpleValue", value=start.strip()))
        else:
            values = _element("arrayValue")
            value.append(values)
            for number in start.strip("[]").split(","):
                entry = _element("value")
                entry.append(_element("simpleValue", value=number.strip()))
                values.append(entry)
    if words:
        told = _element("documentation")
        told.append(_page(words))
        variable.append(told)
    return variable
