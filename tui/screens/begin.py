"""The first questions where there is no table yet: an empty one, one from a file, or one from the clipboard; and its name."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from pathlib import Path

from contextdb.errors import ContextDBError

from ..clipboard import Clipboard
from ..editor import Editor
from ..model.beginning import Beginning, empty_table
from ..model.importing import Import
from ..model.new_table import make_table, name_fault
from ..model.workspace import Workspace
from .ask import AskDialog, ChooseDialog

Way = tuple[str, Callable[[], None]]
"""A line to choose, and what it does."""


class Begin:
    """Asks how to begin, and opens the table that comes of it. Nothing is written before it is decided."""

    def __init__(self, app: Editor, workspace: Workspace, beginning: Beginning) -> None:
        self.app, self.workspace, self.beginning = app, workspace, beginning

    def ask(self) -> None:
        """Ask; a file that was requested is read at once."""
        if self.beginning.source is not None:
            self._name_for(self.beginning.source, partial(self._read, self.beginning.source))
        else:
            self._choose()

    def _choose(self, problem: str = "") -> None:
        begun, ways = self.beginning, self._ways()
        wanted = f"There is no table {begun.name} here yet." if begun.name else "There is no table here yet."
        about = "\n".join(filter(None, (wanted, "What shall be the first?", problem)))

        def chosen(at: int | None) -> None:
            if at is None:
                self.app.exit()
            else:
                ways[at][1]()

        self.app.push_screen(ChooseDialog("Begin", [line for line, _ in ways], about=about), chosen)

    def _ways(self) -> list[Way]:
        begun = self.beginning
        new = f"An empty table {begun.name}" if begun.name else "An empty table"
        ways: list[Way] = [(new, lambda: self._name_for(None, self._make))]
        near = next((name for name, file in self.workspace.files.items() if begun.near in (name, str(file), file.name)), "")
        if near:
            ways.append((f"Open {near}, which there is", partial(self.app.open_table, near)))
        ways += [(f"Read {file.name}", partial(self._name_for, file, partial(self._read, file))) for file in begun.files]
        other = "Read another file: Excel, CSV, Parquet, JSON"
        ways.append((other, lambda: self._name_for(None, partial(self._read, None))))
        ways.append(("Paste what was copied in Excel or elsewhere", lambda: self._name_for(None, self._paste)))
        return ways

    # ---- the name

    def _name_for(self, source: Path | None, then: Callable[[str], None]) -> None:
        """Go on with the name that was requested, else with one from a dialog."""
        taken = list(self.workspace.files)
        if self.beginning.name and not name_fault(self.workspace.folder, self.beginning.name, taken):
            then(self.beginning.name)
            return

        def named(name: str | None) -> None:
            if name is None:
                self._choose()
            else:
                then(name.strip())

        check = partial(name_fault, self.workspace.folder, taken=taken)
        proposed = self.beginning.proposed_name(source, taken)
        self.app.push_screen(AskDialog("New table", "The name of the table and its file", proposed, check), named)

    # ---- the ways

    def _make(self, name: str) -> None:
        self._open(name, None)

    def _paste(self, name: str) -> None:
        text = Clipboard(lambda _: None).paste()
        if text.strip():
            self._import(name, text=text)
        else:
            self._choose("The clipboard is empty. Copy a table first, or paste it with the terminal's key into an empty table.")

    def _read(self, path: Path | None, name: str) -> None:
        self._import(name, path=path)

    def _import(self, name: str, text: str | None = None, path: Path | None = None) -> None:
        from .import_table import ImportDialog

        try:
            table = empty_table(self.workspace.folder, name)
        except ContextDBError as error:
            self._choose(str(error))
            return

        def decided(answer: Import | None) -> None:
            if answer is None:
                self._choose()
            else:
                self._open(name, answer)

        self.app.push_screen(ImportDialog(table, self.workspace.folder, text, path), decided)

    def _open(self, name: str, answer: Import | None) -> None:
        """Write the table, empty, and open it; rows that come from elsewhere are its first step, to be saved or undone."""
        try:
            make_table(self.workspace.folder, name, ())
            self.workspace.look_again()
        except ContextDBError as error:
            self._choose(str(error))
            return
        self.app.open_table(name)
        if answer is not None:
            self.app.begun_with(answer)
