"""What a person sets: themes and keys, and what is said of a file that cannot be taken."""

from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st
from terminal import press, screen_text, with_editor

from contextdb.files.toml_shapes import as_toml
from tui.app import EditorApp
from tui.editor_settings import EditorSettings, SettingsError, read_settings, settings_path

THEMES = EditorApp.theme_names()


def read(folder: Path, text: str | bytes) -> EditorSettings:
    file = folder / "editor.toml"
    file.write_bytes(text if isinstance(text, bytes) else text.encode())
    return read_settings(file, THEMES)


def faults(folder: Path, text: str | bytes) -> list[str]:
    with pytest.raises(SettingsError) as caught:
        read(folder, text)
    assert all("editor.toml" in str(fault) for fault in caught.value.faults)
    return [str(fault) for fault in caught.value.faults]


def is_read_or_refused(folder: Path, text: str | bytes) -> bool:
    try:
        return isinstance(read(folder, text), EditorSettings)
    except SettingsError as error:
        return bool(error.faults)


def test_without_a_file_nothing_is_set(tmp_path):
    assert read_settings(tmp_path / "none.toml", THEMES) == EditorSettings()


def test_a_theme_and_keys_are_taken(tmp_path):
    found = read(tmp_path, '\ufefftheme = "nord"\n[keys]\nduplicate = "ctrl+w"\nsort = "shift+f6, f11"\n')
    assert found.theme == "nord"
    assert dict(found.keys) == {"duplicate": "ctrl+w", "sort": "shift+f6, f11"}


@pytest.mark.parametrize("name", THEMES)
def test_every_theme_can_be_set(tmp_path, name):
    assert read(tmp_path, f'theme = "{name}"').theme == name


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ('theme = "nrod"', ['there is no theme "nrod"', 'Did you mean "nord"?']),
        ("theme = 3", ['there is no theme "3"']),
        ("theme = [1]", ["there is no theme"]),
        ('thema = "nord"', ['there is no setting "thema"', "theme, [keys]"]),
        ('keys = "ctrl+w"', ["[keys] is not a table"]),
        ('[keys]\nduplicat = "ctrl+w"', ['there is no command "duplicat"', 'Did you mean "duplicate"?']),
        ("[keys]\nduplicate = 3", ['the keys of "duplicate" are not text']),
        ('[keys]\nduplicate = ""', ['the keys of "duplicate" are not text']),
        ('[keys]\nduplicate = "ctrl+pageupp"', ['there is no key "ctrl+pageupp"', 'Did you mean "ctrl+pageup"?']),
        ('[keys]\nduplicate = "strg+u"', ['there is no key "strg+u"']),
        ('[keys]\nduplicate = "ctrl+w,"', ['there is no key ""']),
        ('[keys]\nduplicate = "ctrl+s"', ['"ctrl+s" is the key of', '"duplicate"', '"save"']),
        ("[keys", ["cannot read the settings of the editor"]),
        (b"\xff\xfe\x00", ["cannot read the settings of the editor"]),
        (b"theme = \x00", ["cannot read the settings of the editor"]),
    ],
)
def test_what_cannot_be_taken_is_named_with_its_mend(tmp_path, text, said):
    (found,) = faults(tmp_path, text)
    for part in said:
        assert part in found


def test_every_fault_of_a_file_is_named_at_once(tmp_path):
    assert len(faults(tmp_path, 'theme = "x"\ncolour = 1\n[keys]\nfoo = "a"\nsort = "nokey"\n')) == 4


def test_two_commands_may_change_keys_with_each_other(tmp_path):
    assert read(tmp_path, '[keys]\nsave = "ctrl+o"\nopen = "ctrl+s"\n').keys["save"] == "ctrl+o"


@given(st.binary(max_size=60))
def test_any_bytes_are_read_or_refused(tmp_path_factory, raw):
    assert is_read_or_refused(tmp_path_factory.mktemp("any"), raw)


@given(
    st.recursive(
        st.integers() | st.text(max_size=5) | st.booleans(),
        lambda s: st.lists(s, max_size=2) | st.dictionaries(st.text(max_size=5), s, max_size=2),
    )
)
def test_any_value_in_place_of_the_keys_is_read_or_refused(tmp_path_factory, value):
    text = f"theme = {as_toml(value)}\nkeys = {{ sort = {as_toml(value)} }}\n"
    assert is_read_or_refused(tmp_path_factory.mktemp("any"), text)


def test_the_settings_stand_where_the_system_has_them_or_where_the_variable_says(tmp_path, monkeypatch):
    monkeypatch.setattr("sys.platform", "linux")
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path))
    monkeypatch.delenv("CONTEXTDB_EDITOR", raising=False)
    assert settings_path() == tmp_path / "contextdb" / "editor.toml"
    monkeypatch.setenv("CONTEXTDB_EDITOR", str(tmp_path / "mine.toml"))
    assert settings_path() == tmp_path / "mine.toml"


def test_a_folder_in_place_of_the_file_is_no_file(tmp_path):
    assert read_settings(tmp_path, THEMES) == EditorSettings()


# ---- in the editor


@pytest.fixture
def path(tmp_path: Path) -> Path:
    file = tmp_path / "t.csv"
    file.write_text("Asset,hit\nwalk,True\nrun,Any\n")
    return file


def test_the_help_shows_the_keys_of_a_keymap(path):
    async def script(app, pilot):
        await press(pilot, "f1")
        shown = ""
        for _ in range(12):
            shown += screen_text(app)
            await press(pilot, "pagedown")
        return shown

    shown = with_editor(path, script, settings=EditorSettings(keys={"duplicate": "ctrl+w"}))
    assert "Ctrl+U" in shown
    assert "Ctrl+B" not in shown


def test_the_theme_of_the_settings_is_shown_and_another_wins_over_it(path):
    from tui.model.workspace import Workspace

    space = Workspace(path)
    assert EditorApp(space, EditorSettings(theme="nord")).theme == "nord"
    assert EditorApp(space, EditorSettings(theme="nord"), "gruvbox").theme == "gruvbox"
    assert EditorApp(space).theme == "contextdb-dark"
