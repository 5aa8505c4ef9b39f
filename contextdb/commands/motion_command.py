"""Motion matching over the valid assets: databases from clips, a search with its costs, a choice of databases, recorded sessions.

  contextdb motion bones game/clips/walk.bvh
  contextdb motion describe game/clips --out game/moves.csv
  contextdb motion prepare game/
  contextdb motion check game/
  contextdb motion build game/
  contextdb motion search game/ loco --query walk@1.5 --speed 1.3
  contextdb motion run game/ player stick.csv --out session.parquet
  contextdb motion replay session.parquet --at 2.5s
  contextdb motion debug session.parquet

The command `demo --keep game` makes a project to try them on.
"""

from __future__ import annotations

COMMANDS = {
    "describe": "a table from clips: gait, speed, direction, turn and style of each",
    "prepare": "markup proposed for clips, as a diff: contacts, loops, ends, noise, starts, turns, duplicates",
    "bones": "the bones of clips, and which are detected as feet, hips and head",
    "check": "what is wrong with clips, markup and motion settings",
    "build": "save the motion databases that contextdb.toml declares",
    "coverage": "which movements have no clip, in which contexts, and what to capture next",
    "search": "the best frames of one database, with what each channel adds to their cost",
    "select": "which database of a selector wins, with which frame, and why",
    "run": "steer a character along a recorded stick, and record what it decides",
    "probe": "drive a character through the contexts of its tables, without a player, and measure how well it moves",
    "measure": "how good the motion of a session is, compared with its clips",
    "replay": "what was decided in a recorded session, and why",
    "learn": "weights of channels from what people would have chosen in recorded sessions",
    "debug": "the same in the terminal, moment by moment, with poses and weights to change",
}
