"""A small game that shows what contextdb is for: a character who obeys tables. See docs/playground.md.

stick ─► game ─► actors (motion.Character each) ─► poses ─► drawing
           ├── world: the ground, the wall, the ball
           ├── tables/, watched: a save changes the game at once
           └── a link, which `contextdb edit` follows
"""
