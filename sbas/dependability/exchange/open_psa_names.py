"""Definitions of an Open-PSA file, in their containers, and what a reference means."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Literal
from xml.etree.ElementTree import Element

from sbas.dependability.exchange.open_psa_expressions import Lookup, attribute, check_unit
from sbas.exceptions import ModelError

Kind = Literal["gate", "basic-event", "house-event", "parameter"]
_DEFINES: dict[str, Kind] = {
    "define-gate": "gate",
    "define-basic-event": "basic-event",
    "define-house-event": "house-event",
    "define-parameter": "parameter",
}
_CONTAINERS = ("define-fault-tree", "define-component")
_REMARKS = ("label", "attributes")


@dataclass(frozen=True, eq=False)
class Definition:
    """A gate, event or parameter.

    Parameters
    ----------
    kind : what it is.
    identity : its name; with its containers, joined by dots, where it is private.
    path : of its containers.
    element : as it stands in the file.
    """

    kind: Kind
    identity: str
    path: tuple[str, ...]
    element: Element

    @property
    def content(self) -> list[Element]:
        """Child elements but for label and attributes."""
        return [child for child in self.element if child.tag not in _REMARKS]


@dataclass(eq=False)
class Definitions:
    """All definitions of a file, in its order, and the common-cause groups.

    Parameters
    ----------
    where : name of the file, for errors.
    """

    where: str
    tree_name: str = "fault tree"
    remarks: dict[str, str] = field(default_factory=dict)
    events: list[Definition] = field(default_factory=list)
    groups: list[tuple[Element, tuple[str, ...]]] = field(default_factory=list)
    _full: dict[tuple[bool, tuple[str, ...]], Definition] = field(default_factory=dict)
    _public: dict[tuple[bool, str], Definition] = field(default_factory=dict)

    def find(
        self, reference: str, path: tuple[str, ...], where: str, *, kinds: tuple[Kind, ...]
    ) -> Definition:
        """What a reference means from within containers.

        Parameters
        ----------
        reference : a name, or a path of containers and a name joined by dots.
        path : of the containers in which the reference stands.
        where : for errors.
        kinds : that the reference allows.

        Raises
        ------
        ModelError : nothing of that name, or something of another kind.

        Notes
        -----
        The containers are searched from the innermost outward, then the public names.
        """
        parameter = kinds == ("parameter",)
        parts = tuple(reference.split("."))
        found = None
        for depth in range(len(path), -1, -1):
            found = self._full.get((parameter, path[:depth] + parts))
            if found:
                break
        if found is None and len(parts) == 1:
            found = self._public.get((parameter, reference))
        if found is None:
            raise ModelError(f"{reference!r} is used and not defined", where=where)
        if found.kind not in kinds:
            raise ModelError(
                f"{reference!r} is a {found.kind}, used as a {' or '.join(kinds)}", where=where
            )
        return found

    def knows(self, name: str, path: tuple[str, ...]) -> bool:
        """Whether an event of this name is defined in the container, or is a path to one."""
        return "." in name or (False, (*path, name)) in self._full

    def parameters_from(self, path: tuple[str, ...], where: str) -> Lookup:
        """A lookup of parameters from within containers."""

        def lookup(reference: str) -> tuple[str, Element, Lookup]:
            found = self.find(reference, path, where, kinds=("parameter",))
            content = found.content
            if len(content) != 1:
                raise ModelError(f"parameter {reference!r} needs one expression", where=where)
            check_unit(found.element, where)
            return found.identity, content[0], self.parameters_from(found.path, where)

        return lookup

    def add(self, element: Element, path: tuple[str, ...], private: bool) -> None:
        """Take over a definition."""
        kind = _DEFINES[str(element.tag)]
        name = _own_name(element, self.where)
        full = (*path, name)
        hidden = _is_private(element, private, self.where)
        # A name that the format does not allow travels as a remark.
        real = remarks_of(element).get("sbas-name", ".".join(full) if hidden else name)
        definition = Definition(kind, real, path, element)
        space = kind == "parameter"
        if (space, full) in self._full or (not hidden and (space, name) in self._public):
            raise ModelError(
                f"{'.'.join(full)!r} is defined twice",
                where=self.where,
                cure="rename one, or make it private to its container with role='private'",
            )
        self._full[space, full] = definition
        if not hidden:
            self._public[space, name] = definition
        if not space:
            self.events.append(definition)


def read_definitions(root: Element, where: str) -> Definitions:
    """The definitions of fault trees and model data of an Open-PSA document.

    Parameters
    ----------
    root : the element "opsa-mef".
    where : name of the file, for errors.

    Raises
    ------
    ModelError : another root, an element that is not supported, or a name defined twice.
    """
    if root.tag != "opsa-mef":
        raise ModelError(
            f"the root element is <{root.tag}>, not <opsa-mef>",
            where=where,
            cure="give a file in the Open-PSA Model Exchange Format",
        )
    found = Definitions(where)
    trees = [child for child in root if child.tag == "define-fault-tree"]
    if trees:
        label = (trees[0].findtext("label") or "").strip()
        found.tree_name = label or _own_name(trees[0], where)
        found.remarks = remarks_of(trees[0])
    for child in root:
        if child.tag in _CONTAINERS[:1]:
            _collect(child, (), False, found)
        elif child.tag == "model-data":
            for element in child:
                _take(element, (), False, found)
        elif child.tag == "define-CCF-group":
            found.groups.append((child, ()))
        elif child.tag not in _REMARKS:
            raise ModelError(f"<{child.tag}> is not supported", where=where)
    for group, path in found.groups:
        for member in group.iterfind("members/basic-event"):
            name = attribute(member, "name", where)
            if not found.knows(name, path):
                found.add(Element("define-basic-event", {"name": name}), path, False)
    return found


def _collect(container: Element, outer: tuple[str, ...], private: bool, found: Definitions) -> None:
    path = (*outer, _own_name(container, found.where))
    hidden = _is_private(container, private, found.where)
    for element in container:
        if element.tag == "define-component":
            _collect(element, path, hidden, found)
        elif element.tag == "define-CCF-group":
            found.groups.append((element, path))
        elif element.tag not in _REMARKS:
            _take(element, path, hidden, found)


def _take(element: Element, path: tuple[str, ...], private: bool, found: Definitions) -> None:
    if element.tag not in _DEFINES:
        raise ModelError(
            f"<{element.tag}> is not supported", where=f"{found.where}: {'.'.join(path)}"
        )
    found.add(element, path, private)


def remarks_of(element: Element) -> dict[str, str]:
    """The element's attributes in the sense of the format: names and values."""
    return {
        str(remark.get("name")): str(remark.get("value"))
        for remark in element.iterfind("attributes/attribute")
    }


def _own_name(element: Element, where: str) -> str:
    name = attribute(element, "name", where)
    if "." in name:
        raise ModelError(f"the name {name!r} holds a dot, which separates containers", where=where)
    return name


def _is_private(element: Element, outer: bool, where: str) -> bool:
    role = element.get("role", "private" if outer else "public")
    if role not in ("private", "public"):
        raise ModelError(f"the role {role!r} is neither public nor private", where=where)
    return role == "private"
