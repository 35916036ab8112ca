"""Files appear whole or not at all; shipped files are found by name."""

from __future__ import annotations

import os
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest

from discsim.errors import InputError
from discsim.files import digest, model_file, model_names, read_pieces, read_text, write_bytes, write_text


def test_text_is_utf_8_with_the_line_ends_given(tmp_path):
    write_text(tmp_path / "deep" / "file.txt", "a\nß\n")
    assert (tmp_path / "deep" / "file.txt").read_bytes() == "a\nß\n".encode()


def test_a_written_file_has_the_rights_of_any_new_file(tmp_path):
    write_text(tmp_path / "ours", "")
    (tmp_path / "theirs").touch()
    assert (tmp_path / "ours").stat().st_mode == (tmp_path / "theirs").stat().st_mode


@pytest.mark.parametrize("kill", [OSError("disk full"), KeyboardInterrupt()], ids=["disk full", "interrupt"])
@pytest.mark.parametrize("step", ["fdopen", "replace"])
def test_a_write_that_fails_leaves_the_old_file(tmp_path, monkeypatch, step, kill):
    file = tmp_path / "file"
    file.write_bytes(b"old")
    attempt = getattr(os, step)

    def failing(*arguments: object, **options: object) -> None:
        if step == "fdopen":
            os.close(arguments[0])  # type: ignore[arg-type]
        raise kill

    monkeypatch.setattr(os, step, failing)
    with pytest.raises(type(kill)):
        write_bytes(file, b"new")
    monkeypatch.setattr(os, step, attempt)
    assert [child.name for child in tmp_path.iterdir()] == ["file"]
    assert file.read_bytes() == b"old"


def test_an_error_of_the_system_names_the_file_that_was_asked_for(tmp_path):
    (tmp_path / "file").write_text("no folder")
    with pytest.raises(OSError, match=r"file/below") as refused:
        write_text(tmp_path / "file" / "below", "text")
    assert refused.value.filename == str(tmp_path / "file" / "below")


def test_files_written_in_many_threads_have_the_rights_of_any_new_file(tmp_path):
    """The process's mask is one for all threads: who asks for it by setting it opens the files of the others."""
    (tmp_path / "theirs").touch()
    with ThreadPoolExecutor(8) as pool:
        list(pool.map(lambda k: write_text(tmp_path / f"{k}", "x"), range(200)))
    assert {path.stat().st_mode for path in tmp_path.iterdir()} == {(tmp_path / "theirs").stat().st_mode}


def test_reading_drops_the_byte_order_mark_and_carriage_returns(tmp_path):
    (tmp_path / "file").write_bytes(b"\xef\xbb\xbfa\r\nb\rc\n")
    assert read_text(tmp_path / "file") == "a\nb\rc\n"


def test_a_byte_that_is_no_utf_8_is_named_with_its_line(tmp_path):
    (tmp_path / "file").write_bytes(b"\xef\xbb\xbfa\r\nb\xff\n")
    with pytest.raises(InputError, match=r"file:2: byte 0xff is no UTF-8; expected UTF-8 text$"):
        read_text(tmp_path / "file")


def test_a_missing_file_is_named(tmp_path):
    with pytest.raises(InputError, match=r"nowhere: no such file; expected a readable UTF-8 file$"):
        read_text(tmp_path / "nowhere")


def test_a_digest_tells_contents_and_names_apart(tmp_path):
    for folder, name, content in [("a", "x", "1"), ("b", "x", "1"), ("c", "x", "2"), ("d", "y", "1")]:
        write_text(tmp_path / folder / name, content)
    assert digest(tmp_path / "a") == digest(tmp_path / "b")
    assert len({digest(tmp_path / folder) for folder in "acd"}) == 3
    assert digest(tmp_path / "a" / "x") == "6b86b273ff34fce19d6b804eff5a3f5747ada4eaa22f1d49c01e52ddb7875b4b"  # of "1"


def test_every_shipped_file_is_found_by_its_name():
    for folder in ("discs", "parts"):
        assert model_names(folder)
        for name in model_names(folder):
            assert model_file(f"{folder}/{name}.toml").is_file()
    assert model_file("disc.xml").is_absolute()


@pytest.mark.parametrize(
    ("name", "known"), [("discs/frisbee.toml", "driver"), ("nowhere/x.toml", "a file of models/"), ("x.xml", "models/")]
)
def test_an_unknown_shipped_file_is_refused_with_the_known_ones(name, known):
    with pytest.raises(InputError, match=rf"^no shipped file '{name}'; expected one of .*{known}"):
        model_file(name)


def test_the_place_of_shipped_files_does_not_depend_on_the_working_folder(tmp_path, monkeypatch):
    before = model_file("disc.xml")
    monkeypatch.chdir(tmp_path)
    assert model_file("disc.xml") == before
    assert Path(before).is_file()


@pytest.mark.parametrize("size", [1, 3, 7, 1000])
def test_pieces_of_a_file_are_whole_lines_and_make_its_text(tmp_path, size):
    (tmp_path / "file").write_bytes(b"\xef\xbb\xbfone\r\ntwo\n\n" + "größer".encode() + b"\r\n \nend")
    pieces = list(read_pieces(tmp_path / "file", size))
    assert "".join(pieces) == read_text(tmp_path / "file") == "one\ntwo\n\ngrößer\n \nend"
    assert all(piece.endswith("\n") for piece in pieces[:-1])


def test_a_byte_that_is_no_text_is_found_in_any_piece(tmp_path):
    (tmp_path / "file").write_bytes(b"one\ntwo\nthr\xff\n")
    with pytest.raises(InputError, match=r"file:3: byte 0xff is no UTF-8"):
        list(read_pieces(tmp_path / "file", 4))
