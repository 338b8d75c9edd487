"""The script's file: read, run as __main__, and shown in tracebacks alone."""

import sys
import traceback

import pytest

from lockstep_runner import script as running


@pytest.fixture
def run(tmp_path, monkeypatch):
    """Writes a script, runs it, and returns its module's names."""
    monkeypatch.setattr(sys, "argv", [*sys.argv])
    monkeypatch.setattr(sys, "path", ["", *sys.path])
    monkeypatch.setitem(sys.modules, "__main__", sys.modules["__main__"])

    def write_and_run(text, *arguments):
        path = tmp_path / "script.py"
        path.write_bytes(text if isinstance(text, bytes) else text.encode())
        running.run(str(path), arguments, running.compiled(str(path)))
        return vars(sys.modules["__main__"])

    return write_and_run


def test_it_is_main_with_its_arguments(run, tmp_path):
    names = run("import sys\nargv = sys.argv\nname = __name__\nplace = sys.path[0]\n", "--seed", "5")
    assert names["argv"] == [str(tmp_path / "script.py"), "--seed", "5"]
    assert (names["name"], names["place"]) == ("__main__", str(tmp_path))
    assert names["__file__"] == str(tmp_path / "script.py")


def test_it_imports_modules_beside_it(run, tmp_path):
    (tmp_path / "beside_the_script.py").write_text("value = 3\n")
    assert run("import beside_the_script as other\nvalue = other.value\n")["value"] == 3
    sys.modules.pop("beside_the_script")


def test_its_classes_can_be_pickled(run):
    text = "import pickle\nclass State:\n    pass\ncopy = pickle.loads(pickle.dumps(State()))\n"
    assert type(run(text)["copy"]).__name__ == "State"


@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "gb18030", "latin-1"])
def test_encodings_as_python_reads_them(run, encoding):
    word = "é" if encoding == "latin-1" else "小车"
    head = "" if encoding == "utf-8-sig" else f"# -*- coding: {encoding} -*-\n"
    assert run(f"{head}word = '{word}'\n".encode(encoding))["word"] == word


@pytest.mark.parametrize("text", [b"print 'x'\n", b"x = (\n", b"\xff\xfe\x00", b"x = 1\0\n"])
def test_what_is_no_python_is_one_line(run, text):
    with pytest.raises(running.NoScript) as fault:
        run(text)
    assert "\n" not in str(fault.value)


@pytest.mark.parametrize("line", ["print 'x'", "x = 010", "try: f()\nexcept A, b: pass"])
def test_a_script_for_python_2_gets_a_hint(run, line):
    with pytest.raises(running.NoScript, match="2to3"):
        run(line)


def test_no_such_file_and_folders(tmp_path):
    for path in (tmp_path / "none.py", tmp_path):
        with pytest.raises(running.NoScript, match=str(path)):
            running.compiled(str(path))


def test_tracebacks_begin_with_the_script(run, tmp_path):
    with pytest.raises(KeyError) as fault:
        run("def fails():\n    {}['x']\nfails()\n")
    part = running.own_part(fault.value.__traceback__, str(tmp_path / "script.py"))
    assert [frame.name for frame in traceback.extract_tb(part)] == ["<module>", "fails"]
