"""The made clips, each computed once for all tests of a process; nobody can write into them."""

from functools import cache

from contextdb.motion.made import recipes

__all__ = ["made_clips", "make_clip"]


@cache
def make_clip(name: str) -> recipes.MadeClip:
    """A made clip, as `contextdb.motion.made.recipes` makes it."""
    made = recipes.make_clip(name)
    made.clip.values.setflags(write=False)
    return made


def made_clips() -> list[recipes.MadeClip]:
    """All of them, in the order of RECIPES."""
    return [make_clip(name) for name in recipes.RECIPES]
