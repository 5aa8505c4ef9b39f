"""The editor's own colours, dark and light: calm grounds, one accent, and signal colours that are only used for signals."""

from __future__ import annotations

from textual.theme import Theme

DARK, LIGHT = "contextdb-dark", "contextdb-light"

THEMES = (
    Theme(
        name=DARK,
        primary="#6aa7d8",
        secondary="#4d7ea8",
        accent="#6aa7d8",
        warning="#e0b060",
        error="#e57373",
        success="#7cc08a",
        foreground="#d6dae0",
        background="#14171c",
        surface="#1a1e25",
        panel="#242a33",
        boost="#1f2a38",
        dark=True,
        variables={
            "block-cursor-background": "#6aa7d8",
            "block-cursor-foreground": "#10141a",
            "block-cursor-text-style": "bold",
            "footer-key-foreground": "#8fc1ea",
            "footer-background": "#242a33",
            "input-selection-background": "#6aa7d8 35%",
            "scrollbar": "#50565f",
            "scrollbar-hover": "#7a828d",
            "scrollbar-active": "#7a828d",
            "scrollbar-background": "#242a33",
        },
    ),
    Theme(
        name=LIGHT,
        primary="#1f6fb2",
        secondary="#4d7ea8",
        accent="#1f6fb2",
        warning="#9a6700",
        error="#b3261e",
        success="#2e7d43",
        foreground="#1f2328",
        background="#f2f4f7",
        surface="#ffffff",
        panel="#e8ecf1",
        boost="#dfe9f4",
        dark=False,
        variables={
            "block-cursor-background": "#1f6fb2",
            "block-cursor-foreground": "#ffffff",
            "block-cursor-text-style": "bold",
            "footer-key-foreground": "#1f6fb2",
            "footer-background": "#e8ecf1",
            "input-selection-background": "#1f6fb2 30%",
            "scrollbar": "#b4b9c0",
            "scrollbar-hover": "#8a919b",
            "scrollbar-active": "#8a919b",
            "scrollbar-background": "#e8ecf1",
        },
    ),
)
