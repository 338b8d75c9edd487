"""Parsing, with a bound for everything that a text could be large in."""

from collections.abc import Callable
from xml.etree.ElementTree import Element, ParseError, TreeBuilder, XMLParser

from file_reading.content import MAX_BYTES
from file_reading.errors import FileError, TooLarge
from file_reading.xml_text import decode, without_declaration

MAX_DEPTH = 100  # nested elements; real models have about ten
MAX_ELEMENTS = 500_000  # of one text: some 200 MB of memory; large worlds have tens of thousands
STRIDE = 1000  # elements from one call of `count` to the next


class _GuardedBuilder(TreeBuilder):
    """Builds the tree, and refuses what only serves to exhaust the reader."""

    def __init__(self, count: Callable[[int], None]) -> None:
        super().__init__()
        self._depth = self._elements = self._counted = 0
        self._count = count

    def doctype(self, name: str, pubid: str | None, system: str | None) -> None:
        raise FileError("a document type (<!DOCTYPE>) is not taken")

    def start(self, tag: str, attributes: dict[str, str]) -> Element:
        self._depth += 1
        self._elements += 1
        if self._depth > MAX_DEPTH:
            raise TooLarge(f"elements are nested more than {MAX_DEPTH} deep (MAX_DEPTH)")
        if self._elements > MAX_ELEMENTS:
            raise TooLarge(f"there are more than {MAX_ELEMENTS} elements (MAX_ELEMENTS)")
        if self._elements % STRIDE == 0:
            self._tell()
        return super().start(tag, attributes)

    def end(self, tag: str) -> Element:
        self._depth -= 1
        return super().end(tag)

    def close(self) -> Element:
        self._tell()
        return super().close()

    def _tell(self) -> None:
        self._count(self._elements - self._counted)
        self._counted = self._elements


def _nobody_counts(_elements: int) -> None:
    pass


def parse(text: str | bytes, count: Callable[[int], None] = _nobody_counts) -> Element:
    """Returns the root element.

    Args:
        text: a text, or the content of a file, whose encoding is found out.
        count: told now and then how many more elements there are; it may raise to end the parsing.

    Raises:
        FileError: if it isn't well-formed, or has a document type.
        TooLarge: if it is.
    """
    if len(text) > MAX_BYTES:
        raise TooLarge(f"it has more than {MAX_BYTES} bytes (MAX_BYTES)")
    text = without_declaration(decode(text) if isinstance(text, bytes) else text)
    parser = XMLParser(target=_GuardedBuilder(count))
    try:
        parser.feed(text)
        root: Element = parser.close()
    except (ParseError, UnicodeError) as error:  # the latter of half a surrogate pair
        raise FileError(f"not well-formed XML: {error}") from error
    return root
