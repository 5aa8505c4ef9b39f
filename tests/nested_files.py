"""A folder of tables of which one stands in another, for tests."""

from pathlib import Path

TOML = """
[conditions.in_air]
type = "bool"
[conditions.speed]
type = "number"
min = 0.0
max = 10.0
[tables.tackle]
policy = "first"
[tables.dive]
weight = "Weight"
"""
TACKLE = "Asset,in_air,speed\nHit,False,Any\n@dive,True,3..\nFall,True,Any\n"
DIVE = "Asset,Weight,speed\nLeft,1,..8\nRight,3,4..\nSlow,1,..2\n"
AIR = {"in_air": True, "speed": 5.0}


def write(folder: Path, /, **files: str) -> Path:
    """A folder of tables: the usual ones, and others or other texts in their place."""
    for name, text in {"tackle": TACKLE, "dive": DIVE, **files}.items():
        (folder / f"{name}.csv").write_text(text, encoding="utf-8", newline="")
    (folder / "contextdb.toml").write_text(TOML, encoding="utf-8")
    return folder
