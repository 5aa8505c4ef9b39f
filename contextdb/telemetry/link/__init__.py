"""A running game can be watched: `contextdb.link("game")` publishes what it asks and picks, `contextdb live` shows it.

    game            watchers (what is asked and picked) ─► feed, one queue ─► the writer's thread ─► lines ─► a local socket
    contextdb live  hearing ─► lines, and its own version of the tables for the why
    recordings      recorded: the same lines in a file, as contexts

docs/live.md tells the format of the lines. Nothing here listens on a network address.
"""
