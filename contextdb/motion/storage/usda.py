"""Poses as USD: a skeleton and its animation, as text, in one `.usda` file. Metres, y up. Needs nothing but numpy.

Source: Pixar, OpenUSD, the schemas of UsdSkel.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence

import numpy as np

from contextdb.motion.clips.quaternions import Floats
from contextdb.motion.clips.skeleton import Skeleton


def usda_of(rotations: Floats, translations: Floats, rig: Skeleton, rate: float) -> bytes:
    """The bytes of a file, for at least one pose: rotations [T, J, 4] and translations [T, J, 3] of joints against their parents.
    Names that USD cannot have get "_" in place of other letters."""
    joints = _list(f'"{path}"' for path in _paths(rig))
    rest = np.tile(np.eye(4), (rig.n_joints, 1, 1))
    rest[:, 3, :3] = rig.offsets
    world = rest.copy()
    for joint, parent in enumerate(rig.parents.tolist()):
        world[joint, 3, :3] += world[parent, 3, :3] if parent >= 0 else 0.0
    lines = [
        "#usda 1.0",
        "(",
        '    defaultPrim = "Body"\n    metersPerUnit = 1\n    upAxis = "Y"',
        f"    timeCodesPerSecond = {rate!r}\n    startTimeCode = 0\n    endTimeCode = {len(rotations) - 1}",
        ")",
        'def SkelRoot "Body"\n{',
        '    def Skeleton "Skeleton" (prepend apiSchemas = ["SkelBindingAPI"])\n    {',
        f"        uniform token[] joints = {joints}",
        f"        uniform matrix4d[] bindTransforms = {_matrices(world)}",
        f"        uniform matrix4d[] restTransforms = {_matrices(rest)}",
        "        rel skel:animationSource = </Body/Animation>\n    }",
        '    def SkelAnimation "Animation"\n    {',
        f"        uniform token[] joints = {joints}",
        f"        half3[] scales = {_list(['(1, 1, 1)'] * rig.n_joints)}",
        f"        float3[] translations.timeSamples = {_samples(translations)}",
        f"        quatf[] rotations.timeSamples = {_samples(rotations)}",
        "    }\n}",
    ]
    return "\n".join([*lines, ""]).encode()


def _paths(rig: Skeleton) -> list[str]:
    """Each joint with those above it, as USD names them."""
    paths: list[str] = []
    for name, parent in zip(rig.names, rig.parents.tolist(), strict=True):
        plain = re.sub(r"^(?=\d|$)|\W", "_", name, flags=re.ASCII)
        path = f"{paths[parent]}/{plain}" if parent >= 0 else plain
        while path in paths:
            path += "_"
        paths.append(path)
    return paths


def _samples(values: Floats) -> str:
    return "{ " + ", ".join(f"{i}: {_list(map(_tuple, frame.tolist()))}" for i, frame in enumerate(values)) + " }"


def _matrices(matrices: Floats) -> str:
    return _list("( " + ", ".join(map(_tuple, matrix)) + " )" for matrix in matrices.tolist())


def _tuple(numbers: Sequence[float]) -> str:
    return f"({', '.join(f'{number:.9g}' for number in numbers)})"


def _list(items: Iterable[str]) -> str:
    return f"[{', '.join(items)}]"
