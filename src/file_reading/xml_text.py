"""The text of an XML file, whatever its encoding and whatever stands before its declaration."""

import codecs
import re

from file_reading.errors import FileError

MARKS = (  # of byte order; UTF-32's before UTF-16's, which it begins with
    (codecs.BOM_UTF8, "utf-8"),
    (codecs.BOM_UTF32_LE, "utf-32-le"),
    (codecs.BOM_UTF32_BE, "utf-32-be"),
    (codecs.BOM_UTF16_LE, "utf-16-le"),
    (codecs.BOM_UTF16_BE, "utf-16-be"),
)
# Names as Python writes them. Others of its codecs are none of files (hex), or take minutes (punycode).
ENCODINGS = re.compile(
    r"ascii|utf-8|iso8859-\d+|cp(437|850|125\d|932|949|950)|koi8-[ru]|mac-roman|gb2312|gbk|gb18030|"
    r"big5|shift_jis|euc_(jp|kr)"
)
DECLARED = re.compile(r"""encoding\s*=\s*["']([A-Za-z][\w.-]{0,40})["']""")
BLANKS = re.compile(r"\s*")
HEAD = 4096  # [bytes] in which the encoding has to be declared


def decode(data: bytes) -> str:
    """Returns the text of a file: as its byte-order mark says, or its declaration, or else UTF-8.

    Raises:
        FileError: if it isn't written so, or in an encoding that is not known here.
    """
    for mark, name in MARKS:
        if data.startswith(mark):
            return _decoded(data[len(mark) :], name)
    for bracket, name in ((b"<\0", "utf-16-le"), (b"\0<", "utf-16-be")):
        if data.startswith(bracket):
            return _decoded(data, name)
    # A declaration that can be read as ASCII doesn't stand in UTF-16, whatever it says.
    head = data[:HEAD].decode("latin-1")
    start, end = _declaration(head)
    declared = DECLARED.search(head, start, end)
    if declared is None or declared.group(1).lower().startswith(("utf-16", "utf16", "ucs-2")):
        return _decoded(data, "utf-8")
    try:
        name = codecs.lookup(declared.group(1)).name
    except LookupError:
        name = ""
    if not ENCODINGS.fullmatch(name):
        raise FileError(f"its encoding '{declared.group(1)}' is not known here")
    return _decoded(data, name)


def without_declaration(text: str) -> str:
    """Returns `text` without byte-order mark and XML declaration; blanks and comments may stand before it.

    A parser takes nothing before the declaration, and there is nothing in it that a text still needs.
    """
    text = text.removeprefix("\ufeff")
    start, end = _declaration(text)
    return text[:start] + text[end:]


def _declaration(text: str) -> tuple[int, int]:
    """Where the XML declaration begins and ends; both are the same if there is none."""
    start = _after_blanks(text, 0)
    while text.startswith("<!--", start):
        end = text.find("-->", start + 4)
        if end < 0:
            break
        start = _after_blanks(text, end + 3)
    end = text.find("?>", start)
    if end < 0 or not (text.startswith("<?xml", start) and text[start + 5 : start + 6].isspace()):
        return start, start
    return start, end + 2


def _after_blanks(text: str, start: int) -> int:
    match = BLANKS.match(text, start)
    return start if match is None else match.end()


def _decoded(data: bytes, name: str) -> str:
    try:
        return data.decode(name)
    except UnicodeDecodeError as error:
        raise FileError(
            f"byte {error.start} is no {name}: is its encoding declared in the first line?"
        ) from error
