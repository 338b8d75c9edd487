"""Parsing XML of any encoding, within bounds of size, depth and number of elements."""

import codecs
import re
from xml.etree.ElementTree import Element, ParseError, TreeBuilder, XMLParser

from file_access.content import MAX_BYTES, FileError, TooLarge

MAX_DEPTH = 100  # nested elements; real models have about ten
MAX_ELEMENTS = 500_000  # of one text: some 200 MB of memory; large worlds have tens of thousands

BYTE_ORDER_MARKS = (  # UTF-32's before UTF-16's, which are their first bytes
    (codecs.BOM_UTF8, "utf-8"),
    (codecs.BOM_UTF32_LE, "utf-32-le"),
    (codecs.BOM_UTF32_BE, "utf-32-be"),
    (codecs.BOM_UTF16_LE, "utf-16-le"),
    (codecs.BOM_UTF16_BE, "utf-16-be"),
)
# By Python's names. Some of its other codecs aren't for text (hex), or take minutes (punycode).
ENCODINGS = re.compile(
    r"ascii|utf-8|iso8859-\d+|cp(437|850|125\d|932|949|950)|koi8-[ru]|mac-roman|gb2312|gbk|gb18030|"
    r"big5|shift_jis|euc_(jp|kr)"
)
# Real files have blanks and comments before the declaration, which XML doesn't allow. Atomic groups: a
# comment that is tried in all possible lengths would take exponential time.
DECLARATION = re.compile(r"(?>\s+|<!--.*?-->)*+(<\?xml\s.*?\?>)", re.DOTALL)
DECLARED_ENCODING = re.compile(r"""encoding\s*=\s*["']([A-Za-z][\w.-]{0,40})["']""")
HEAD = 4096  # [bytes] that are searched for the declaration


class _BoundedBuilder(TreeBuilder):
    """Builds the tree; refuses document types (entities) and trees beyond the bounds."""

    def __init__(self) -> None:
        super().__init__()
        self._depth = self._elements = 0

    def doctype(self, name: str, pubid: str | None, system: str | None) -> None:
        raise FileError("a document type (<!DOCTYPE>) is not accepted")

    def start(self, tag: str, attributes: dict[str, str]) -> Element:
        self._depth += 1
        self._elements += 1
        if self._depth > MAX_DEPTH:
            raise TooLarge(f"elements are nested more than {MAX_DEPTH} deep (MAX_DEPTH)")
        if self._elements > MAX_ELEMENTS:
            raise TooLarge(f"there are more than {MAX_ELEMENTS} elements (MAX_ELEMENTS)")
        return super().start(tag, attributes)

    def end(self, tag: str) -> Element:
        self._depth -= 1
        return super().end(tag)


def parse(text: str | bytes) -> Element:
    """Returns the root element of a text or a file's content; raises FileError, TooLarge beyond a bound."""
    if len(text) > MAX_BYTES:
        raise TooLarge(f"it has more than {MAX_BYTES} bytes (MAX_BYTES)")
    text = without_declaration(decode(text) if isinstance(text, bytes) else text)
    parser = XMLParser(target=_BoundedBuilder())
    try:
        parser.feed(text)
        root: Element = parser.close()
    except (ParseError, UnicodeError) as error:  # the latter for half a surrogate pair
        raise FileError(f"not well-formed XML: {error}") from error
    return root


def decode(data: bytes) -> str:
    """Returns a file's text, by its byte-order mark, declaration, or else as UTF-8; raises FileError."""
    for mark, name in BYTE_ORDER_MARKS:
        if data.startswith(mark):
            return _decoded(data[len(mark) :], name)
    for bracket, name in ((b"<\0", "utf-16-le"), (b"\0<", "utf-16-be")):
        if data.startswith(bracket):
            return _decoded(data, name)
    declaration = DECLARATION.match(data[:HEAD].decode("latin-1"))
    declared = DECLARED_ENCODING.search(declaration.group(1)) if declaration else None
    # A declaration that can be read as ASCII isn't UTF-16, whatever it says.
    if declared is None or declared.group(1).lower().startswith(("utf-16", "utf16", "ucs-2")):
        return _decoded(data, "utf-8")
    try:
        name = codecs.lookup(declared.group(1)).name
    except LookupError:
        name = ""
    if not ENCODINGS.fullmatch(name):
        raise FileError(f"its encoding '{declared.group(1)}' is not supported")
    return _decoded(data, name)


def without_declaration(text: str) -> str:
    """Returns a text without byte-order mark and XML declaration, before which parsers accept nothing."""
    text = text.removeprefix("\ufeff")
    declaration = DECLARATION.match(text)
    if declaration is None:
        return text
    return text[: declaration.start(1)] + text[declaration.end(1) :]


def _decoded(data: bytes, name: str) -> str:
    try:
        return data.decode(name)
    except UnicodeDecodeError as error:
        raise FileError(
            f"byte {error.start} is not valid {name}: is its encoding declared in the first line?"
        ) from error
