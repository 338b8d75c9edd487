"""XML of every encoding, with whatever before its declaration, and texts that only exhaust their reader."""

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from file_access import xml_text
from file_access.content import FileError, TooLarge
from file_access.xml_text import parse

TEXT = '<a name="Gelände">\r\n<b/>\r\n</a>'
BEFORE = ["", " ", "\n\n", "\t\r\n", "<!-- by hand -->\n", "\n<!-- one --><!-- two -->\n "]
ENCODINGS = [
    "utf-8", "UTF-8", "iso-8859-1", "latin-1", "windows-1252", "us-ascii", "utf-16", "gb18030",
]  # fmt: skip


def written(before, declared, codec, mark=b""):
    name = "" if declared is None else f'<?xml version="1.0" encoding="{declared}"?>\r\n'
    text = TEXT.replace("ä", "a") if codec == "us-ascii" else TEXT
    return mark + f"{before}{name}{text}".encode(codec)


def check(root):
    assert root.tag == "a"
    assert root.get("name") in ("Gelände", "Gelande")
    assert len(root) == 1


@pytest.mark.parametrize("before", BEFORE)
def test_a_text_may_have_anything_harmless_before_its_declaration(before):
    for declaration in ("", '<?xml version="1.0"?>', "<?xml version='1.0' encoding='latin-1'?>"):
        for mark in ("", "\ufeff"):
            check(parse(f"{mark}{before}{declaration}{TEXT}"))


@pytest.mark.parametrize("before", BEFORE)
@pytest.mark.parametrize("encoding", ENCODINGS)
def test_a_file_is_read_in_the_encoding_that_it_declares(encoding, before):
    codec = "utf-8" if encoding == "utf-16" else encoding  # which what reads as ASCII can't be in
    check(parse(written(before, encoding, codec)))


@pytest.mark.parametrize("declared", [None, "utf-8", "utf-16", "iso-8859-1"])
@pytest.mark.parametrize("codec", ["utf-8", "utf-16-le", "utf-16-be", "utf-32-le", "utf-32-be"])
def test_a_byte_order_mark_says_more_than_the_declaration(codec, declared):
    check(parse(written("\n", declared, codec, "\ufeff".encode(codec))))


@pytest.mark.parametrize("codec", ["utf-16-le", "utf-16-be"])
def test_utf_16_needs_no_mark(codec):
    check(parse(written("", "utf-16", codec)))


def assert_refused(data, fault):
    with pytest.raises(FileError) as raised:
        parse(data)
    assert fault in str(raised.value) and "\n" not in str(raised.value)


@pytest.mark.parametrize(
    ("data", "fault"),
    [
        (b"<a>\xe9</a>", "byte 3 is not valid utf-8: is its encoding declared in the first line?"),
        (b"\xff\xfe<", "is not valid utf-16-le"),
        (b'<?xml version="1.0" encoding="klingon"?><a/>', "encoding 'klingon' is not supported"),
        (b'<?xml version="1.0" encoding="punycode"?><a/>', "'punycode' is not supported"),
        (b'<?xml version="1.0" encoding="hex"?><a/>', "its encoding 'hex' is not supported"),
        (b"", "not well-formed XML: no element found"),
        (b"\0\0\0", "not well-formed XML"),
        ("<a>\ud800</a>", "not well-formed XML"),
        ('<a/><?xml version="1.0"?>', "not well-formed XML"),
        ("<?xmlish?><a/>" * 2, "not well-formed XML"),
        ("<!-- open <?xml version='1.0'?><a/>", "not well-formed XML"),
        ("x<?xml version='1.0'?><a/>", "not well-formed XML"),
    ],
)
def test_what_is_no_xml_says_so_in_one_line(data, fault):
    assert_refused(data, fault)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("text", "fault"),
    [
        ('<!DOCTYPE a [<!ENTITY b "bb">]><a>&b;</a>', "(<!DOCTYPE>) is not accepted"),
        ('<!DOCTYPE a SYSTEM "http://example.com/a.dtd"><a/>', "(<!DOCTYPE>) is not accepted"),
        ('<!DOCTYPE a [<!ENTITY b SYSTEM "file:///dev/zero">]><a>&b;</a>', "(<!DOCTYPE>)"),
        ("<a>" * 101 + "</a>" * 101, "nested more than 100 deep"),
        ("<a>" * 1_000_000, "nested more than 100 deep"),
        ("<a>" + "<b/>" * 500_000 + "</a>", "more than 500000 elements (MAX_ELEMENTS)"),
    ],
)
def test_traps_are_refused(text, fault):
    assert_refused(text, fault)


def test_a_text_beyond_the_limit_is_not_looked_at(monkeypatch):
    monkeypatch.setattr(xml_text, "MAX_BYTES", 10)
    for text in ("<" * 11, b"<" * 11):
        with pytest.raises(TooLarge, match=r"^it has more than 10 bytes \(MAX_BYTES\)$"):
            parse(text)


@settings(deadline=None)
@given(st.binary(max_size=60) | st.text(alphabet="<>?!-xml \n\ufeff", max_size=60).map(str.encode))
def test_no_bytes_are_anything_but_a_tree_or_a_fault(data):
    try:
        root = parse(data)
    except FileError as error:
        assert "\n" not in str(error)
    else:
        assert isinstance(root.tag, str)
