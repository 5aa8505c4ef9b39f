"""Git's conflict marks in a text: named with their lines, never read as rows."""

from __future__ import annotations

import re

from contextdb.errors import Fault, Place, TableError, plural

_MARK = re.compile(r"^(?:<{7}|>{7}|\|{7})(?: .*)?$|^={7}$", re.MULTILINE)
_ACCEPTED = "one version of each row"
_MEND = 'to keep one side and delete the lines "<<<<<<<", "=======" and ">>>>>>>"'


def begins_like_a_mark(text: str) -> bool:
    """Whether a text begins as a mark of git does, so that the row it begins may be none."""
    return text.startswith(("<<<<<<<", ">>>>>>>", "|||||||"))


def require_no_conflicts(text: str, file: str) -> None:
    """Refuse a text in which git left a conflict. Raises TableError with the lines on which conflicts start; a mark that is alone,
    after a mend that was not finished, is named too."""
    unified = text.replace("\r\n", "\n").replace("\r", "\n")
    marks, line, at = list[tuple[int, str]](), 1, 0
    for match in _MARK.finditer(unified):
        line, at = line + unified.count("\n", at, match.start()), match.start()
        marks.append((line, match[0][0]))
    starts = [line for line, mark in marks if mark == "<"]
    if not starts and not any(mark == ">" for _, mark in marks):
        return
    first = starts[0] if starts else marks[0][0]
    what = "an unresolved git conflict starts here" if starts else "this line is a conflict mark of git"
    more = f"; there are {plural(len(starts), 'conflict')} in the file" if len(starts) > 1 else ""
    raise TableError(Fault(f"{what}{more}.", _ACCEPTED, _MEND, Place(file, first)))
