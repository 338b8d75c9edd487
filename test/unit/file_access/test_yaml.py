"""YAML of parameters: of every encoding, with angles, and files that only exhaust their reader."""

import math

import pytest

from file_access.content import FileError
from file_access.yaml_text import load_documents, load_parameters

TEXT = "# Gelände\r\narm:\r\n  gain: 1.5\r\n  joints: [a, b]\r\n"
MERGES = "a0: &a0 {" + ", ".join(f"k{i}: 1" for i in range(10)) + "}\n"
MERGES += "".join(f"a{n}: &a{n} {{<<: [{', '.join([f'*a{n - 1}'] * 10)}]}}\n" for n in range(1, 9))
ALIASES = "a0: &a0 [1]\n"
ALIASES += "".join(f"a{n}: &a{n} [{', '.join([f'*a{n - 1}'] * 10)}]\n" for n in range(1, 9))


@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "utf-16", "utf-16-le"])
def test_files_of_every_encoding_of_yaml(encoding):
    mark = "\ufeff" if encoding == "utf-16-le" else ""
    documents = load_parameters((mark + TEXT).encode(encoding))
    assert documents == [{"arm": {"gain": 1.5, "joints": ["a", "b"]}}]


@pytest.mark.parametrize(
    ("text", "angle"),
    [
        ("deg(90)", math.pi / 2), ("rad(pi/2)", math.pi / 2), ("!degrees 180", math.pi),
        ("!radians 2*pi", 2 * math.pi), ("rad(-pi + 1e-3)", 1e-3 - math.pi), ("deg(-45)", -math.pi / 4),
    ],
)  # fmt: skip
def test_angles_are_radians(text, angle):
    assert load_parameters(f"a: {text}") == [{"a": pytest.approx(angle)}]


@pytest.mark.slow
@pytest.mark.parametrize(
    ("text", "fault"),
    [
        ("a: [1, 2", "line 1, column "),
        ("a: 1\n\tb: 2", "line 2, column 1: "),
        ("a: !!python/object/apply:os.system [ls]", "line 1, column 4: could not determine a constructor"),
        ("- 1", "expected 'name: value' lines, found list"),
        ("5", "expected 'name: value' lines, found int"),
        ("a: {b: }", "a/b has no value"),
        ("a: [1, ~]", "a[1] has no value"),
        ("a: {1: x}", "a: the name 1 is not a text: put it in quotes"),
        ("a: !!set {b}", "a: a set can't be a parameter"),
        ("a: 2001-02-03", "a: a date can't be a parameter"),
        ("a: 2001-99-99", "a value can't be read: month must be in 1..12"),
        ("a: " + "9" * 5000, "a value can't be read: "),
        ("a: {? [1]\n : 2}", "line 1, column "),
        ("a: &a [*a]", "a value contains itself"),
        ("a: &a {b: {c: *a}}", "a value contains itself"),
        ("a: rad(9**9**9)", "line 1, column 4: 'rad(9**9**9)' is not an angle"),
        ("a: !radians __import__('os').getcwd()", "is not an angle"),
        ("a: rad(1/0)", "is not an angle"),
        ("a: !degrees " + "1+" * 5000 + "1", "is not an angle"),
        ("a: " + "[" * 100_000, "nested more than 50 deep (MAX_DEPTH)"),
        ("a: " + "[" * 60 + "]" * 60, "nested more than 50 deep (MAX_DEPTH)"),
        ("a: " + "x" * 2**20, "more than 1048576 bytes (MAX_BYTES)"),
        (ALIASES, "more than 100000 values (MAX_VALUES)"),
        (MERGES, "more than 100000 values (MAX_VALUES)"),
        ("a: \0", "special characters are not allowed"),
        (b"a: \xe9", "unacceptable character"),
    ],
    ids=range(26),
)  # fmt: skip
def test_what_cannot_be_parameters_says_so_in_one_line(text, fault):
    with pytest.raises(FileError) as raised:
        load_parameters(text)
    assert fault in str(raised.value)
    assert "\n" not in str(raised.value)
    assert len(str(raised.value)) < 1100


def test_anchors_that_are_used_within_reason_are_written_out():
    (document,) = load_documents("a: &a {p: 1}\nb: {<<: *a, q: 2}\nc: [*a, *a]")
    assert document == {"a": {"p": 1}, "b": {"p": 1, "q": 2}, "c": [{"p": 1}, {"p": 1}]}
    assert load_parameters("a: 1\n---\n---\nb: 2\n") == [{"a": 1}, {"b": 2}]
